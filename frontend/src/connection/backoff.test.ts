import { expect, test } from 'vitest';

import { backoffMs, TRY_AGAIN_LATER } from './machine';

test('doubles with each failure up to 15 s', () => {
  const longest = [1, 2, 3, 4, 5, 6, 50].map((failures) => backoffMs(failures, 1, null));
  expect(longest).toEqual([500, 1000, 2000, 4000, 8000, 15_000, 15_000]);
});

test('jitter spreads over the upper half', () => {
  expect(backoffMs(3, 0, null)).toBe(1000);
  expect(backoffMs(3, 0.5, null)).toBe(1500);
});

test('a full server is left alone longer', () => {
  expect(backoffMs(1, 0, TRY_AGAIN_LATER)).toBe(5000);
});
