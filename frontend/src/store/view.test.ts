import { expect, test } from 'vitest';

import { DEFAULT_VIEW, fixedRange, reduceView } from './view';

test('each sensor keeps its own fixed range', () => {
  const range = { low: 1, high: 2 };
  const fixed = reduceView(DEFAULT_VIEW, { type: 'range', range });
  const other = reduceView(fixed, { type: 'sensor', sensor: 'co2' });
  expect(fixedRange(other)).toBeNull();
  const both = reduceView(other, { type: 'range', range: { low: 400, high: 900 } });
  const back = reduceView(both, { type: 'sensor', sensor: DEFAULT_VIEW.sensor });
  expect(fixedRange(back)).toEqual(range);
  const free = reduceView(back, { type: 'range', range: null });
  expect([...free.ranges.keys()]).toEqual(['co2']);
  expect(DEFAULT_VIEW.ranges.size).toBe(0);
});

test('the sensor that is in view already changes nothing', () => {
  const same = { type: 'sensor', sensor: DEFAULT_VIEW.sensor } as const;
  expect(reduceView(DEFAULT_VIEW, same)).toBe(DEFAULT_VIEW);
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
