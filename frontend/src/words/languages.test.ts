import { readFileSync } from 'node:fs';
import { join } from 'node:path';

import { expect, test } from 'vitest';

import { chosenLanguage, LANGUAGE_NAMES, LANGUAGES } from './languages';

test.each([
  ['', ['de-AT', 'en'], { language: 'de', locale: 'de-AT' }],
  ['', ['nl'], { language: 'nl', locale: 'nl-NL' }],
  // The first supported language, not the first one listed.
  ['', ['fr-FR', 'es-MX', 'de'], { language: 'es', locale: 'es-MX' }],
  ['', ['fr', 'pl'], { language: 'en', locale: 'en-GB' }],
  ['', [], { language: 'en', locale: 'en-GB' }],
  ['?lang=nl', ['de-DE'], { language: 'nl', locale: 'nl-NL' }],
  ['?lang=DE-ch', ['en-US'], { language: 'de', locale: 'de-CH' }],
  ['?kiosk=1&lang=de', ['fr', 'de-CH'], { language: 'de', locale: 'de-CH' }],
  // English dates have one format, whatever the region.
  ['?lang=en-US', ['de'], { language: 'en', locale: 'en-GB' }],
  // The browser's language does not replace an unsupported ?lang=.
  ['?lang=xx', ['de'], { language: 'en', locale: 'en-GB' }],
  ['?lang=', ['de'], { language: 'en', locale: 'en-GB' }],
  ['?lang=de-!', [], { language: 'de', locale: 'de-DE' }],
])('“%s” and a browser that prefers %j: %j', (search, preferred, choice) => {
  expect(chosenLanguage(search, preferred)).toEqual(choice);
});

test.each(LANGUAGES)('the shift report in “%s” has dates as the page writes them', (language) => {
  const file = join(import.meta.dirname, '../../../backend/lupin_bridge/past/report_words.json');
  const words = JSON.parse(readFileSync(file, 'utf8')) as Readonly<
    Record<string, { readonly date: string; readonly months: readonly string[] }>
  >;
  const { date = '', months = [] } = words[language] ?? {};
  const { locale } = chosenLanguage(`?lang=${language}`, []);
  const page = new Intl.DateTimeFormat(locale, { day: 'numeric', month: 'short', year: 'numeric' });
  const written = months.map((month) =>
    date.replace('{day}', '7').replace('{month}', month).replace('{year}', '2026'),
  );
  expect(written.map((each) => each.replaceAll('\u00a0', ' '))).toEqual(
    Array.from({ length: 12 }, (_, month) => `${page.format(new Date(2026, month, 7))}, {clock}`),
  );
});

test('each language has its own name', () => {
  expect(new Set(Object.values(LANGUAGE_NAMES)).size).toBe(LANGUAGES.length);
});
