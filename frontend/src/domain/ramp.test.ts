import { describe, expect, test } from 'vitest';

import { fieldAlpha, fraction, hslToRgb, mix, rangeOf, rgbText, sensorColour } from './ramp';
import { sensorNamed } from '../testing/sensors';

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
  const range = { low: 10, high: 20 };

  test('is 0 at the minimum, 60 % at the maximum, linear between', () => {
    expect(fieldAlpha(sensorNamed('temperature'), range, 10)).toBe(0);
    expect(fieldAlpha(sensorNamed('temperature'), range, 15)).toBeCloseTo(0.3);
    expect(fieldAlpha(sensorNamed('temperature'), range, 20)).toBeCloseTo(0.6);
  });

  test('is clamped outside a fixed range', () => {
    expect(fieldAlpha(sensorNamed('temperature'), range, -5)).toBe(0);
    expect(fieldAlpha(sensorNamed('temperature'), range, 99)).toBeCloseTo(0.6);
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
