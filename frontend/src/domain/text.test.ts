import { expect, test } from 'vitest';

import { shown } from './text';

test.each([
  ['Lavandula angustifolia', 'Lavandula angustifolia'],
  ['žluťoučký kůň 薔薇 🌷', 'žluťoučký kůň 薔薇 🌷'],
  ['a\u0000b\u0007c\nd', 'a\ufffdb\ufffdc\ufffdd'],
  ['safe\u202eexe.txt', 'safe\ufffdexe.txt'],
  ['\u2066left\u2069', '\ufffdleft\ufffd'],
  ['zero\u200bwidth', 'zero\ufffdwidth'],
  ['  12  ', '12'],
  ['   ', '\u2423'],
  ['', '\u2423'],
])('%j is shown as %j', (text, expected) => {
  expect(shown(text)).toBe(expected);
});

test('long text is cut by characters, not through one', () => {
  expect(shown('🌷'.repeat(20), 5)).toBe('🌷🌷🌷🌷…');
  expect(Array.from(shown('x'.repeat(1e6)))).toHaveLength(80);
});

test('marks do not pile up', () => {
  expect(shown(`z${'\u0301'.repeat(50)}`)).toBe(`z${'\u0301'.repeat(3)}`);
});
