import { expect, test } from 'vitest';

import { csv } from './text';

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
