import { describe, expect, test, vi } from 'vitest';

import {
  ageSeconds,
  endsNow,
  freshness,
  hasDate,
  PERIOD_KINDS,
  rosText,
  shortRosText,
  spanOf,
} from './time';

describe('age', () => {
  test('is the time since the observation', () => {
    expect(ageSeconds(97, 103.5)).toBe(6.5);
  });

  test('is never negative: messages overtake each other', () => {
    expect(ageSeconds(1_005, 1_000)).toBe(0);
  });

  test.each([
    ['that nobody observed', 'never', 1_000],
    ['far ahead, of a clock that was set back', 2_000, 1_000],
    ['as of a time that is not known', 1_000, null],
  ] as const)('a tag %s has none', (_, at, now) => {
    expect(ageSeconds(at, now)).toBeNull();
  });
});

describe('freshness', () => {
  test('is full for a minute, then falls, and never to nothing', () => {
    expect(freshness(0)).toBe(1);
    expect(freshness(60)).toBe(1);
    expect(freshness(300)).toBeLessThan(1);
    expect(freshness(600)).toBeLessThan(freshness(300));
    expect(freshness(1e9)).toBeCloseTo(0.35);
    expect(freshness(null)).toBeCloseTo(0.35);
  });
});

// An offset with half an hour, set before any module reads the clock.
vi.hoisted(() => {
  vi.stubEnv('TZ', 'Asia/Kolkata');
});

test('a moment is a date on the operator’s own clock', () => {
  expect(rosText(Date.UTC(2026, 10, 13, 21, 42, 40) / 1000)).toBe('14 Nov 2026, 03:12:40');
  // What has not ended yet is not shown.
  expect(rosText(Date.UTC(2026, 10, 13, 21, 42, 40) / 1000 + 0.999)).toBe('14 Nov 2026, 03:12:40');
  expect(shortRosText(Date.UTC(2026, 10, 13, 21, 42, 40) / 1000)).toBe('14 Nov, 03:12:40');
});

test('a simulation that counts from its beginning has no dates', () => {
  expect(rosText(5_025.9)).toBe('sim 01:23:45');
  expect(shortRosText(5_025.9)).toBe('sim 01:23:45');
  expect(rosText(0)).toBe('sim 00:00:00');
  expect(rosText(360_000)).toBe('sim 100:00:00');
  expect([999_999_999, 1_000_000_000].map(hasDate)).toEqual([false, true]);
});

const NOW = 1_794_000_000;

test.each([
  ['hour', 3_600],
  ['day', 86_400],
  ['week', 7 * 86_400],
  ['month', 30 * 86_400],
] as const)('the last %s ends now', (kind, length) => {
  expect(spanOf({ kind }, NOW, null)).toEqual({ from: NOW - length, to: NOW });
  expect(spanOf({ kind }, NOW, 0)).toEqual({ from: NOW - length, to: NOW });
  expect(spanOf({ kind }, NOW, NOW - 500), 'a young twin').toEqual({ from: NOW - 500, to: NOW });
});

test('everything begins with memory, and is a day as long as nobody knows', () => {
  expect(spanOf({ kind: 'all' }, NOW, NOW - 500)).toEqual({ from: NOW - 500, to: NOW });
  expect(spanOf({ kind: 'all' }, NOW, null)).toEqual({ from: NOW - 86_400, to: NOW });
  // History after now belongs to another clock; a span is never empty.
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
