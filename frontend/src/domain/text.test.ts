import { expect, test } from 'vitest';

import { csv, shown } from './text';

test.each([
  ['Lavandula angustifolia', 'Lavandula angustifolia'],
  ['žluťoučký kůň 薔薇 🌷', 'žluťoučký kůň 薔薇 🌷'],
  ['a\u0000b\u0007c\nd', 'a\ufffdb\ufffdc\ufffdd'],
  ['safe\u202eexe.txt', 'safe\ufffdexe.txt'],
  ['\u2066left\u2069', '\ufffdleft\ufffd'],
  ['zero\u200bwidth', 'zero\ufffdwidth'],
  ['joined\u200dtext', 'joined\ufffdtext'],
  [
    '\u{1f468}\u{1f3fd}\u200d\u{1f33e} and \u{1f33e}\u200d',
    '\u{1f468}\u{1f3fd}\u200d\u{1f33e} and \u{1f33e}\ufffd',
  ],
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

const line = (cell: string | number | null): string => csv([[cell]]).slice(1, -2);

test('a mark of byte order, commas and line ends as in RFC 4180', () => {
  expect(
    csv([
      ['a', 'b'],
      [1, null],
    ]),
  ).toBe('\ufeffa,b\r\n1,\r\n');
});

test.each([
  ['a,b', '"a,b"'],
  ['say "hi"', '"say ""hi"""'],
  ['two\nlines', '"two\nlines"'],
  ['=1+1', "'=1+1"],
  ['+1', "'+1"],
  ['-1', "'-1"],
  ['@cmd', "'@cmd"],
  ['  =1', "'  =1"],
  ['\t=1', "'\t=1"],
  ['=HYPERLINK("x","y")', '"\'=HYPERLINK(""x"",""y"")"'],
])('text %j is written as %s', (text, written) => {
  expect(line(text)).toBe(written);
});

test('numbers stay numbers, and what is none stays empty', () => {
  expect(line(-3.5)).toBe('-3.5');
  expect(line(NaN)).toBe('');
});
