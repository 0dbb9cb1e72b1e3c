import { expect, test } from 'vitest';

import { endsNow, PERIOD_KINDS, spanOf } from './time';

const NOW = 1_794_000_000;

test.each([
  ['hour', 3_600],
  ['day', 86_400],
  ['week', 7 * 86_400],
  ['month', 30 * 86_400],
] as const)('the last %s ends now', (kind, length) => {
  expect(spanOf({ kind }, NOW, null)).toEqual({ from: NOW - length, to: NOW });
});

test('everything begins with memory, and is a day as long as nobody knows', () => {
  expect(spanOf({ kind: 'all' }, NOW, NOW - 500)).toEqual({ from: NOW - 500, to: NOW });
  expect(spanOf({ kind: 'all' }, NOW, null)).toEqual({ from: NOW - 86_400, to: NOW });
  // What memory has from later than now is a run of another clock; a stretch is never empty.
  expect(spanOf({ kind: 'all' }, NOW, NOW + 9)).toEqual({ from: NOW - 1, to: NOW });
});

test('a simulation that has just begun has no time before 0', () => {
  expect(spanOf({ kind: 'day' }, 100, null)).toEqual({ from: 0, to: 100 });
});

test('an own period stays where it is; all others go on', () => {
  const own = { kind: 'own', from: 5, to: 9 } as const;
  expect(spanOf(own, NOW, null)).toEqual({ from: 5, to: 9 });
  expect(endsNow(own)).toBe(false);
  expect(PERIOD_KINDS.map((kind) => endsNow({ kind }))).not.toContain(false);
});
