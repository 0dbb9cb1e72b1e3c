import { describe, expect, test } from 'vitest';

import { VERDICTS } from './health';
import { MARKS, speciesLooks, speciesText, svgPath } from './marks';

describe('marks', () => {
  test('no two verdicts have the same outline and fill', () => {
    const looks = VERDICTS.map((verdict) => {
      const { outline, isHollow } = MARKS[verdict];
      return `${outline === 'circle' ? outline : outline.length} ${isHollow}`;
    });
    expect(new Set(looks).size).toBe(VERDICTS.length);
  });

  test('whatever is filled has a sign of its own, which lies within it', () => {
    const signs = VERDICTS.filter((verdict) => !MARKS[verdict].isHollow).map((verdict) => {
      const { sign } = MARKS[verdict];
      expect(sign.flat().every(([x, y]) => Math.hypot(x, y) < 0.8)).toBe(true);
      return JSON.stringify(sign);
    });
    expect(new Set(signs).size).toBe(3);
  });

  test('a path is in the middle of its box', () => {
    const line = [[-1, 0], [1, 0.5]] as const; // prettier-ignore
    expect(svgPath([line], 6)).toBe('M2 8L14 11');
    expect(svgPath([line], 6, true)).toBe('M2 8L14 11Z');
  });
});

test('each species has a look of its own, whatever the order of arrival', () => {
  const names = ['rose', 'tulip', 'orchid', 'gerbera', 'lupin'];
  const looks = speciesLooks(names);
  expect(new Set([...looks.values()].map(({ colour }) => String(colour))).size).toBe(names.length);
  expect(new Set([...looks.values()].map(({ shape }) => shape)).size).toBe(3);
  expect(speciesLooks([...names].reverse())).toEqual(looks);
});

test('beyond the list looks repeat and nothing hangs', () => {
  const names = Array.from({ length: 40 }, (_, i) => `species ${i}`);
  expect(speciesLooks(names).size).toBe(40);
});

test('no name, no look', () => {
  expect(speciesLooks(['', 'rose']).has('')).toBe(false);
});

test('a name that the page knows is in its language, in any case; another is shown as it came', () => {
  expect(['Rose', 'Begonia', 'constructor'].map((name) => speciesText(name))).toEqual([
    'rose',
    'Begonia',
    'constructor',
  ]);
});
