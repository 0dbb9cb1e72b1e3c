/** Loads one language's texts. English is bundled; the others are separate chunks. */
import { ENGLISH } from './en';
import type { Language } from './languages';
import type { Words } from './shape';

type Loads<Part> = Readonly<Record<Exclude<Language, 'en'>, () => Promise<Part>>>;

/** A part of the texts; null: it could not be loaded. */
export async function partOf<Part>(
  language: Language,
  english: Part,
  loads: Loads<Part>,
): Promise<Part | null> {
  return language === 'en' ? english : loads[language]().catch(() => null);
}

export const wordsOf = (language: Language): Promise<Words | null> =>
  partOf<Words>(language, ENGLISH, {
    de: async () => (await import('./de')).GERMAN,
    nl: async () => (await import('./nl')).DUTCH,
    es: async () => (await import('./es')).SPANISH,
  });
