import { expect, test } from 'vitest';

import { VERDICTS } from './health';
import { MARKS, speciesLooks, speciesText } from './marks';

test('no two verdicts look the same, and whoever is known has a sign', () => {
  const looks = VERDICTS.map((verdict) => `${MARKS[verdict].outline} ${MARKS[verdict].sign}`);
  expect(new Set(looks).size).toBe(VERDICTS.length);
  expect(VERDICTS.filter((verdict) => MARKS[verdict].sign === '')).toEqual(['unknown']);
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

test('a name that the page knows is in its language, in any case; another begins with a capital too', () => {
  expect(['ROSE', 'begonia', 'constructor'].map((name) => speciesText(name))).toEqual([
    'Rose',
    'Begonia',
    'Constructor',
  ]);
});
