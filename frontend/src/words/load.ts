/** One language's words. All but English come over the network, and only to whom they are for. */
import { ENGLISH } from './en';
import type { Language } from './languages';
import type { Words } from './shape';

/** null: they could not be had. */
export async function wordsOf(language: Language): Promise<Words | null> {
  try {
    switch (language) {
      case 'en':
        return ENGLISH;
      case 'de':
        return (await import('./de')).GERMAN;
      case 'nl':
        return (await import('./nl')).DUTCH;
      case 'es':
        return (await import('./es')).SPANISH;
    }
  } catch {
    return null;
  }
}
