import { expect, test } from 'vitest';

import { DEFAULT_VIEW, reduceView } from './view';

test('another sensor lets go of a fixed range, the same one keeps it', () => {
  const fixed = reduceView(DEFAULT_VIEW, { type: 'range', range: { low: 1, high: 2 } });
  expect(reduceView(fixed, { type: 'sensor', sensor: 'co2' }).range).toBeNull();
  expect(reduceView(fixed, { type: 'sensor', sensor: DEFAULT_VIEW.sensor })).toBe(fixed);
});

test('a column sorts upwards first, then downwards, then upwards', () => {
  const once = reduceView(DEFAULT_VIEW, { type: 'sort', column: 'age' });
  const twice = reduceView(once, { type: 'sort', column: 'age' });
  const thrice = reduceView(twice, { type: 'sort', column: 'age' });
  expect([once, twice, thrice].map(({ sort }) => sort.descending)).toEqual([false, true, false]);
});

test('layers go on and off without touching the old set', () => {
  const off = reduceView(DEFAULT_VIEW, { type: 'layer', layer: 'pins', on: false });
  expect(off.layers.has('pins')).toBe(false);
  expect(DEFAULT_VIEW.layers.has('pins')).toBe(true);
  expect(reduceView(off, { type: 'layer', layer: 'pins', on: true }).layers.has('pins')).toBe(true);
});

test('smooth is on demand, everything else is on', () => {
  expect(DEFAULT_VIEW.layers.has('smooth')).toBe(false);
  expect(DEFAULT_VIEW.layers.has('field')).toBe(true);
});
