import { expect, test } from 'vitest';

import { speciesColours } from './species';

test('each species has a colour of its own, whatever the order of arrival', () => {
  const names = ['rose', 'tulip', 'orchid', 'gerbera', 'lupin'];
  const colours = speciesColours(names);
  expect(new Set([...colours.values()].map(String)).size).toBe(names.length);
  expect(speciesColours([...names].reverse())).toEqual(colours);
});

test('beyond the palette colours repeat and nothing hangs', () => {
  const names = Array.from({ length: 40 }, (_, i) => `species ${i}`);
  expect(speciesColours(names).size).toBe(40);
});

test('no name, no colour', () => {
  expect(speciesColours(['', 'rose']).has('')).toBe(false);
});
