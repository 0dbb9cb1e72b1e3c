/** The languages that the page speaks, and which of them somebody gets. Pure. */

export const LANGUAGES = ['en', 'de', 'nl', 'es'] as const;

export type Language = (typeof LANGUAGES)[number];

/** Each in its own words: who looks for theirs reads no other. */
export const LANGUAGE_NAMES: Readonly<Record<Language, string>> = {
  en: 'English',
  de: 'Deutsch',
  nl: 'Nederlands',
  es: 'Español',
};

/**
 * How numbers and dates are written where the browser names no region. English has the day before
 * the month and a clock of 24 hours in every region: "3/4" and "2:00" must not be read two ways.
 */
const LOCALES: Readonly<Record<Language, string>> = {
  en: 'en-GB',
  de: 'de-DE',
  nl: 'nl-NL',
  es: 'es-ES',
};

export interface Choice {
  readonly language: Language;
  /** For `Intl`: the language, and the region where one is known. */
  readonly locale: string;
  /** What `?lang=` asks for and the page does not speak; null: nothing. */
  readonly unknown: string | null;
}

/** By `?lang=`, else the first of the browser's languages that the page speaks, else English. */
export function chosenLanguage(search: string, preferred: readonly string[]): Choice {
  const asked = new URLSearchParams(search).get('lang');
  const spoken = asked === null ? null : languageOf(asked);
  const own = asked === null ? preferred.map(languageOf).find((each) => each !== null) : spoken;
  const language = own ?? 'en';
  return {
    language,
    locale: localeFor(language, asked === null ? preferred : [asked, ...preferred]),
    unknown: spoken === null ? asked : null,
  };
}

/** "de-AT" and "DE" are German; null: the page does not speak it. */
function languageOf(tag: string): Language | null {
  const name = tag.split('-')[0]?.toLowerCase();
  return LANGUAGES.find((each) => each === name) ?? null;
}

/** In Switzerland and Mexico the point is a point, also to who reads German and Spanish. */
function localeFor(language: Language, preferred: readonly string[]): string {
  if (language === 'en') return LOCALES.en;
  const regional = preferred.find((tag) => languageOf(tag) === language && tag.includes('-'));
  try {
    return Intl.getCanonicalLocales(regional ?? LOCALES[language])[0] ?? LOCALES[language];
  } catch {
    return LOCALES[language];
  }
}

/** The address of the same view in another language. */
export function inLanguage(
  { pathname, search, hash }: Pick<Location, 'pathname' | 'search' | 'hash'>,
  language: Language,
): string {
  const query = new URLSearchParams(search);
  query.set('lang', language);
  return `${pathname}?${query.toString()}${hash}`;
}
