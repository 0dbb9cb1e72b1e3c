import { expect, test, vi } from 'vitest';

import { fieldOf, momentOf } from './TimeBar';

// Half an hour off the full one, and set before any module looks at the clock.
vi.hoisted(() => {
  process.env['TZ'] = 'Asia/Kolkata';
});

const AT = Date.UTC(2026, 10, 13, 21, 42, 5) / 1000;

test('a date is on the operator’s clock, there and back', () => {
  expect(fieldOf(AT + 0.9, false)).toBe('2026-11-14T03:12:05');
  expect(momentOf('2026-11-14T03:12:05', false)).toBe(AT);
  expect(momentOf('2026-11-14T03:12', false)).toBe(AT - 5);
});

test('a simulation counts hours from its beginning', () => {
  expect(fieldOf(3_723, true)).toBe('1:02:03');
  expect(momentOf('1:02:03', true)).toBe(3_723);
  expect(momentOf(' 100:00 ', true)).toBe(360_000);
});

test.each([
  ['', false],
  ['yesterday', false],
  ['2026-11', false],
  ['1960-01-01T00:00', false],
  ['', true],
  ['1:60:00', true],
  ['7', true],
])('%j is no time', (text, isSimulated) => {
  expect(momentOf(text, isSimulated)).toBeNull();
});
