/**
 * Every word that the page shows, in the language of who reads it: the page is not evaluated any
 * further before the words are here. The catalogue is in `words/`.
 */
import { ENGLISH } from './words/en';
import { chosenLanguage, LANGUAGE_NAMES } from './words/languages';
import { wordsOf } from './words/load';
import type { Words } from './words/shape';

const isPage = typeof document !== 'undefined';
const chosen = chosenLanguage(
  isPage ? window.location.search : '',
  isPage ? navigator.languages : [],
);
// English is here already, and waits for nothing.
const words = chosen.language === 'en' ? ENGLISH : await wordsOf(chosen.language);

export const S: Words = words ?? ENGLISH;

/** What is spoken, and in which region's manner numbers and dates are written. */
export const LANGUAGE = words ? chosen.language : 'en';
export const LOCALE = words ? chosen.locale : 'en-GB';

/** Why it is not the language that was asked for; null: it is. */
export const LANGUAGE_TROUBLE: string | null = !words
  ? S.languageMissing(LANGUAGE_NAMES[chosen.language])
  : chosen.unknown === null
    ? null
    : S.languageUnknown(chosen.unknown);
