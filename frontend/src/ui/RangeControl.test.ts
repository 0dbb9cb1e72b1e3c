import { expect, test } from 'vitest';

import { startingRange } from './RangeControl';
import { sensorNamed } from '../testing/sensors';

const temperature = sensorNamed('temperature');

test('starts with what is in use, rounded outwards', () => {
  const { low, high } = startingRange(temperature, { low: 12.347, high: 28.912 });
  expect(low).toBeLessThanOrEqual(12.347);
  expect(high).toBeGreaterThanOrEqual(28.912);
  expect(high - low).toBeLessThan(19);
  expect(String(low).length).toBeLessThanOrEqual(4);
});

test('without a width it takes the ideal range, and without that one unit to each side', () => {
  expect(startingRange(temperature, { low: 20, high: 20 })).toEqual({ low: 18, high: 26 });
  expect(startingRange(sensorNamed('ph'), { low: 7, high: 7 })).toEqual({ low: 6, high: 8 });
  expect(startingRange(sensorNamed('ph'), null)).toEqual({ low: 0, high: 1 });
});
