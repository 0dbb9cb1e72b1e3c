/** The words of the estimate, which come with it; the same in English where they cannot be had. */
import { ESTIMATE } from './en/estimate';
import type { Language } from './languages';
import type { In } from './shape';

type EstimateWords = In<typeof ESTIMATE>;

export async function estimateWordsOf(language: Language): Promise<EstimateWords> {
  try {
    switch (language) {
      case 'en':
        return ESTIMATE;
      case 'de':
        return (await import('./de/estimate')).ESTIMATE;
      case 'nl':
        return (await import('./nl/estimate')).ESTIMATE;
      case 'es':
        return (await import('./es/estimate')).ESTIMATE;
    }
  } catch {
    return ESTIMATE;
  }
}
