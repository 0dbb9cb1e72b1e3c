import { expect, test } from 'vitest';

import { CATALOGUES } from '../testing/sensors';
import { errorText, estimateText } from './parts';

const sensor = (name: string): ReturnType<typeof CATALOGUES.day.named> =>
  CATALOGUES.day.named(name);
const plain = (text: string): string => text.replaceAll('\u00a0', ' ');

test.each([
  ['temperature', 22.41, 0.79, '22.4 ± 1.3 °C'],
  ['temperature', 20.2, 0.377, '20.2 ± 0.6 °C'],
  ['temperature', 20.2, 0.02, '20.2 ± 0.03 °C'],
  ['temperature', -2, 12, '−2.0 ± 19.7 °C'],
  ['co2', 536.2, 22, '536 ± 36 ppm'],
  ['co2', 536.2, 0.2, '536 ± 0.33 ppm'],
] as const)('%s %d, error %d: %s', (name, mean, sd, text) => {
  expect(plain(estimateText(sensor(name), mean, sd, 'C'))).toBe(text);
});

test('an error is a difference: no 32 in it', () => {
  expect(plain(errorText(sensor('temperature'), 1, 'F'))).toBe('3.0 °F');
});
