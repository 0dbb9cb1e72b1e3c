import { expect, test } from 'vitest';

import { differenceToShown, fromShown, toShown, unitOf } from './sensors';
import { sensorNamed } from '../testing/sensors';

const temperature = sensorNamed('temperature');
const humidity = sensorNamed('humidity');

test('temperatures follow the operator, other units do not', () => {
  expect(toShown(temperature, 25, 'F')).toBe(77);
  expect(toShown(temperature, 25, 'C')).toBe(25);
  expect(unitOf(temperature, 'F')).toBe('°F');
  expect(toShown(humidity, 25, 'F')).toBe(25);
  expect(unitOf(humidity, 'F')).toBe('%');
});

test('a difference has no offset', () => {
  expect(differenceToShown(temperature, 10, 'F')).toBe(18);
});

test('what is typed comes back', () => {
  expect(fromShown(temperature, toShown(temperature, 21.5, 'F'), 'F')).toBeCloseTo(21.5);
});
