import { expect, test } from 'vitest';

import { fitting } from './fitting';

const ENTRIES = [50, 100, 150];

test('all fit without room for a line that nobody needs', () => {
  expect(fitting(ENTRIES, 3, 150, 30)).toBe(3);
});

test('one pixel less, and the line takes the place of what no longer fits beside it', () => {
  expect(fitting(ENTRIES, 3, 149, 30)).toBe(2);
  expect(fitting(ENTRIES, 3, 129, 30)).toBe(1);
});

test('where more are than were laid out the line is always there', () => {
  expect(fitting(ENTRIES, 9, 179, 30)).toBe(2);
  expect(fitting(ENTRIES, 9, 180, 30)).toBe(3);
});

test('nothing at all may fit', () => {
  expect(fitting(ENTRIES, 3, 40, 30)).toBe(0);
  expect(fitting([], 0, 40, 30)).toBe(0);
});
