import { expect, test, vi } from 'vitest';

import { hasDate, rosText, secondsOf, shortRosText } from './time';

// Half an hour off the full one, and set before any module looks at the clock.
vi.hoisted(() => {
  process.env['TZ'] = 'Asia/Kolkata';
});

test('a moment is a date on the operator’s own clock', () => {
  expect(rosText(Date.UTC(2026, 10, 13, 21, 42, 40) / 1000)).toBe('14 Nov 2026, 03:12:40');
  // What is not over yet is not told.
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

test('a stamp in seconds', () => {
  expect(secondsOf({ sec: 12, nanosec: 250_000_000 })).toBe(12.25);
});
