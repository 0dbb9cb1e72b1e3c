import { expect, test } from 'vitest';

import { MOST_CHARTED } from '../store/view';
import { lookOf, markerPath, without } from './layers';

const all = Array.from({ length: MOST_CHARTED }, (_, index) => lookOf(index));

test('each line of a chart has a colour, a dash and a marker that no other has', () => {
  expect(new Set(all.map(({ colour }) => colour)).size).toBe(MOST_CHARTED);
  expect(new Set(all.map(({ dash }) => dash.join())).size).toBe(MOST_CHARTED);
  expect(new Set(all.map(({ marker }) => marker)).size).toBe(MOST_CHARTED);
});

test('a marker is a path around its point', () => {
  for (const { marker } of all) expect(markerPath(marker, 10, 20, 6)).toMatch(/^M[-\d. LMaZ]+$/);
  expect(markerPath('square', 10, 20, 10)).toBe('M5.5 15.5L14.5 15.5L14.5 24.5L5.5 24.5Z');
});

test('a gap is hatched once: where the journal is incomplete, only as that', () => {
  const gaps = [
    { from: 0, to: 10 },
    { from: 20, to: 30 },
  ];
  const missing = [
    { from: -5, to: 3 },
    { from: 22, to: 24 },
  ];
  expect(without(gaps, missing)).toEqual([
    { from: 3, to: 10 },
    { from: 20, to: 22 },
    { from: 24, to: 30 },
  ]);
});
