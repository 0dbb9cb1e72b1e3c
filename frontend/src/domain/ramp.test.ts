import { describe, expect, test } from 'vitest';

import { sensorNamed } from '../testing/sensors';
import { numberText } from './format';
import {
  fieldShade,
  fraction,
  heldRange,
  hslToRgb,
  mix,
  type Range,
  rangeOf,
  rgbText,
  rounded,
  sensorColour,
  withDistinctEnds,
  withIdeal,
} from './ramp';

test.each([
  [0, 100, 50, [255, 0, 0]],
  [120, 100, 25, [0, 128, 0]],
  [240, 100, 50, [0, 0, 255]],
  [0, 0, 100, [255, 255, 255]],
  [205, 72, 45, [32, 129, 197]],
] as const)('hsl(%d, %d, %d)', (h, s, l, rgb) => {
  expect(hslToRgb(h, s, l)).toEqual(rgb);
});

test('the sensors have the colours that the bridge’s pictures have', () => {
  expect(sensorColour(sensorNamed('temperature'))).toEqual([219, 60, 36]);
  expect(sensorColour(sensorNamed('co2'))).toEqual([166, 34, 211]);
  expect(sensorColour(sensorNamed('nobody declared this'))).toEqual([112, 36, 219]);
});

describe('alpha of the heat map', () => {
  const shade = fieldShade(sensorNamed('temperature'), { low: 10, high: 20 });
  const alpha = (value: number): number => shade(value, 0).alpha;

  test('is 0 at the minimum, 60 % at the maximum, linear between', () => {
    expect(alpha(10)).toBe(0);
    expect(alpha(15)).toBeCloseTo(0.3);
    expect(alpha(20)).toBeCloseTo(0.6);
  });

  test('is clamped outside a fixed range', () => {
    expect(alpha(-5)).toBe(0);
    expect(alpha(99)).toBeCloseTo(0.6);
  });

  test('a range of no width shows its value', () => {
    expect(fraction({ low: 7, high: 7 }, 7)).toBe(1);
    expect(fraction({ low: 7, high: 7 }, 6)).toBe(0);
  });
});

test('range of readings, without those that are no number', () => {
  expect(rangeOf([3, null, 1, undefined, NaN, Infinity])).toEqual({ low: 1, high: 3 });
  expect(rangeOf([null])).toBeNull();
});

test('mixing and writing colours', () => {
  expect(mix([0, 0, 0], [200, 100, 50], 0.5)).toEqual([100, 50, 25]);
  expect(rgbText([1, 2, 3])).toBe('rgb(1 2 3)');
  expect(rgbText([1, 2, 3], 0.5)).toBe('rgb(1 2 3 / 0.5)');
});

const run = (values: readonly (readonly [number, number])[]): Range[] => {
  let held: Range | null = null;
  return values.map(([low, high]) => (held = heldRange(held, { low, high })));
};

test('is rounded outwards', () => {
  expect(rounded({ low: 20.34, high: 31.2 })).toEqual({ low: 20, high: 32 });
  expect(rounded({ low: 7, high: 7 })).toEqual({ low: 7, high: 7 });
});

test('of values that nobody can tell apart its ends are told apart', () => {
  for (const [low, high] of [
    [14.8, 14.8],
    [14.8, 14.81],
    [-3, -3],
    [0, 0],
    [0.3, 0.3],
    [1013, 1013],
  ] as const) {
    const range = withDistinctEnds({ low, high });
    expect(numberText(range.high)).not.toBe(numberText(range.low));
    expect(Math.abs(fraction(range, low) - 0.5)).toBeLessThan(0.1);
  }
  expect(withDistinctEnds({ low: 20, high: 22 })).toEqual({ low: 20, high: 22 });
});

test('values that come and go at its edge do not make it flicker', () => {
  const ranges = run([
    [20.2, 29.8],
    ...Array.from({ length: 50 }, (_, n) => [20.2, 29.8 + 0.4 * (n % 2)] as const),
  ]);
  // It widens once, then stays.
  expect(new Set(ranges).size).toBe(2);
  expect(ranges.at(-1)).toEqual({ low: 20, high: 31 });
});

test('it widens at once, and narrows only when much of it lies idle', () => {
  const [, wide, still, narrow] = run([
    [20, 30],
    [20, 40],
    [20, 34.1],
    [20, 33.9],
  ]);
  expect(wide).toEqual({ low: 20, high: 40 });
  expect(still).toBe(wide);
  expect(narrow).toEqual({ low: 20, high: 34 });
});

test('no value is ever outside of it', () => {
  let held: Range | null = null;
  for (let n = 0; n < 500; n++) {
    const data = { low: 20 + 9 * Math.sin(n * 1.7), high: 30 + 8 * Math.cos(n * 0.9) };
    if (data.low > data.high) continue;
    held = heldRange(held, data);
    expect(held.low).toBeLessThanOrEqual(data.low);
    expect(held.high).toBeGreaterThanOrEqual(data.high);
  }
});

test('an ideal greenhouse is in the middle of its colours, and noise moves nothing', () => {
  expect(withIdeal({ low: 21.8, high: 22.2 }, [18, 26])).toEqual({ low: 18, high: 26 });
  expect(withIdeal({ low: 21.8, high: 31 }, [18, 26])).toEqual({ low: 18, high: 31 });
  expect(withIdeal({ low: 21.8, high: 31 }, null)).toEqual({ low: 21.8, high: 31 });
});
