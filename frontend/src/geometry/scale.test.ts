import { describe, expect, test } from 'vitest';

import { gridStep, lengthText, niceFloor, scaleBar } from './coordinates';

test.each([
  [1, 1],
  [1.9, 1],
  [2, 2],
  [4.99, 2],
  [73, 50],
  [0.034, 0.02],
])('round length not above %d is %d', (value, expected) => {
  expect(niceFloor(value)).toBeCloseTo(expected);
});

describe('scale bar', () => {
  test('is never longer than allowed and says its true length', () => {
    for (const scale of [4, 13, 50, 99, 1234]) {
      const { metres, pixels } = scaleBar(scale, 110);
      expect(pixels).toBeLessThanOrEqual(110);
      expect(pixels).toBeCloseTo(metres * scale);
    }
  });
});

describe('grid', () => {
  test('lines keep their distance, and no more than about twice of it', () => {
    for (const scale of [4, 13, 50, 99, 180, 1234]) {
      const pixels = gridStep(scale, 56) * scale;
      expect(pixels).toBeGreaterThanOrEqual(56 - 1e-9);
      expect(pixels).toBeLessThanOrEqual(56 * 2.5 + 1e-9);
    }
  });
});

test.each([
  [0.05, '5 cm'],
  [0.5, '50 cm'],
  [1, '1 m'],
  [20, '20 m'],
  [5000, '5 km'],
])('%d m reads %s', (metres, text) => {
  expect(lengthText(metres)).toBe(text);
});
