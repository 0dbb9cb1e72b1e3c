/** The supported languages, and which one a user gets. Pure. */

export const LANGUAGES = ['en', 'de', 'nl', 'es'] as const;

export type Language = (typeof LANGUAGES)[number];

/** Each language's name in itself, so that its speakers find it. */
export const LANGUAGE_NAMES: Readonly<Record<Language, string>> = {
  en: 'English',
  de: 'Deutsch',
  nl: 'Nederlands',
  es: 'Español',
};

/**
 * Locale for numbers and dates if the browser names no region. English always has day before month and
 * a 24-hour clock: "3/4" and "2:00" must not be ambiguous.
 */
const LOCALES: Readonly<Record<Language, string>> = {
  en: 'en-GB',
  de: 'de-DE',
  nl: 'nl-NL',
  es: 'es-ES',
};

export interface Choice {
  readonly language: Language;
  /** For `Intl`: the language, with the region if known. */
  readonly locale: string;
}

/** The language of `?lang=`, else the browser's first supported language, else English. */
export function chosenLanguage(search: string, preferred: readonly string[]): Choice {
  const requested = new URLSearchParams(search).get('lang');
  const wanted = requested === null ? preferred : [requested];
  const language = wanted.map(languageOf).find((each) => each !== null) ?? 'en';
  return { language, locale: localeFor(language, [...wanted, ...preferred]) };
}

/** "de-AT" and "DE" are German; null: not supported. */
function languageOf(tag: string): Language | null {
  const name = tag.split('-')[0]?.toLowerCase();
  return LANGUAGES.find((each) => each === name) ?? null;
}

/** The browser's locale of that language: Swiss and Mexican numbers have a decimal point, for example. */
function localeFor(language: Language, preferred: readonly string[]): string {
  if (language === 'en') return LOCALES.en;
  const regional = preferred.find((tag) => languageOf(tag) === language && tag.includes('-'));
  try {
    return Intl.getCanonicalLocales(regional ?? LOCALES[language])[0] ?? LOCALES[language];
  } catch {
    return LOCALES[language];
  }
}
