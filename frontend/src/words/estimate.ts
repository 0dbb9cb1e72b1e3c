/** The estimate's texts, loaded with it; English if the language fails to load. */
import { ESTIMATE } from './en/estimate';
import type { Language } from './languages';
import { partOf } from './load';
import type { In } from './shape';

type EstimateWords = In<typeof ESTIMATE>;

export async function estimateWordsOf(language: Language): Promise<EstimateWords> {
  const words = await partOf<EstimateWords>(language, ESTIMATE, {
    de: async () => (await import('./de/estimate')).ESTIMATE,
    nl: async () => (await import('./nl/estimate')).ESTIMATE,
    es: async () => (await import('./es/estimate')).ESTIMATE,
  });
  return words ?? ESTIMATE;
}
