/**
 * Every text of the page, in the reader's language: no later module is evaluated before it is loaded.
 * The catalogue is in `words/`.
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
// English is in the first chunk.
const words = chosen.language === 'en' ? ENGLISH : await wordsOf(chosen.language);

export const S: Words = words ?? ENGLISH;

/** The language, and the region's format of numbers and dates. */
export const LANGUAGE = words ? chosen.language : 'en';
export const LOCALE = words ? chosen.locale : 'en-GB';

/** Why it is not the requested language; null: it is. */
export const LANGUAGE_TROUBLE = words ? null : S.languageMissing(LANGUAGE_NAMES[chosen.language]);
