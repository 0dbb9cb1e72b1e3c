import { expect, test, vi } from 'vitest';

import {
  ageText,
  beyondLimitText,
  differenceNumber,
  metresText,
  momentText,
  numberText,
  percentText,
  rangeText,
  readingText,
  shortAgeText,
  valueText,
} from './format';
import { sensorNamed } from '../testing/sensors';

test.each([
  [0, '0.0'],
  [0.042, '0.042'],
  [-0.004, '\u22120.0040'],
  [21.456, '21.5'],
  [-3.25, '\u22123.3'],
  [99.96, '100.0'],
  [999.6, '1,000'],
  [1_234.5, '1,235'],
  [100, '100'],
  [612.4, '612'],
  [-80_000, '\u221280,000'],
  [1e6, '1.00e+6'],
  [1234567, '1.23e+6'],
])('%d reads %s', (value, text) => {
  expect(numberText(value)).toBe(text);
});

test('a reading holds on to its unit', () => {
  expect(readingText(sensorNamed('temperature'), 20)).toBe('20.0\u00a0°C');
  expect(readingText(sensorNamed('temperature', 'F'), 20)).toBe('68.0\u00a0°F');
  expect(readingText(sensorNamed('ph'), 7)).toBe('7.0');
});

test.each([
  [0.9, '0\u00a0s'],
  [59.9, '59\u00a0s'],
  [60, '1\u00a0min'],
  [3599, '59\u00a0min'],
  [3600, '1\u00a0h'],
  [5_100, '1\u00a0h 25\u00a0min'],
  [90_061, '1\u00a0d 1\u00a0h'],
])('%d s is %s old', (seconds, text) => {
  expect(ageText(seconds)).toBe(text);
});

test('an age has the letters of the language', async () => {
  vi.resetModules();
  vi.stubGlobal('document', {});
  vi.stubGlobal('window', { location: { search: '?lang=nl' } });
  vi.stubGlobal('navigator', { languages: [] });
  const dutch = await import('./format');
  vi.unstubAllGlobals();
  expect([4_680, 90_061].map(dutch.ageText)).toEqual(['1\u00a0u 18\u00a0min', '1\u00a0d 1\u00a0u']);
  expect(dutch.intervalText(3_600)).toBe('1\u00a0u');
  expect(dutch.shortAgeText(4_680)).toBe('1\u00a0u');
});

test('a short age is in one unit', () => {
  expect([59, 3_599, 3_600, 82_740, 90_061].map(shortAgeText)).toEqual([
    '59\u00a0s',
    '59\u00a0min',
    '1\u00a0h',
    '22\u00a0h',
    '1\u00a0d',
  ]);
});

test('shares and lengths', () => {
  expect(percentText(0.847)).toBe('85\u00a0%');
  expect(metresText(-1.456)).toBe('\u22121.46');
});

test('a range has its unit once and never breaks; none is a dash', () => {
  const sensor = sensorNamed('temperature');
  expect(rangeText(sensor, [-1, 30])).toBe('\u22121.0\u00a0to\u00a030.0\u00a0°C');
  expect(rangeText(sensor, null)).toBe('–');
});

test('a moment has its date, in an order that sorts', () => {
  expect(momentText(new Date(2026, 4, 1, 9, 3, 2).getTime())).toBe('2026-05-01 09:03:02');
});

test.each([
  [0.0001, '0.00010'],
  [0.0014, '0.0014'],
  [0.042, '0.042'],
  [0.25, '0.25'],
  [-0.0004, '\u22120.00040'],
  [0, '0.0'],
])('%d of a sensor that nobody knows reads %s, and never as nothing', (value, text) => {
  expect(valueText(sensorNamed('spin'), value)).toBe(text);
  expect(valueText(sensorNamed('temperature'), value)).toMatch(/^.?\d\.\d\d?$/);
});

/** Numbers of every size, the same in each run (Park and Miller 1988). */
function* sizes(count: number): Generator<number> {
  let seed = 20_261_124;
  const next = (): number => (seed = (seed * 48_271) % 2_147_483_647) / 2_147_483_647;
  for (let each = 0; each < count; each++) {
    yield (next() < 0.5 ? -1 : 1) * 10 ** (next() * 9 - 4);
  }
}
const read = (text: string): number => Number(text.replace('\u2212', '-').replace(',', ''));

test('of a sensor that nobody knows no text is off by more than a twentieth of its value', () => {
  const sensor = sensorNamed('spin');
  for (const value of sizes(2_000)) {
    const slack = Math.abs(value) * 0.05;
    expect(Math.abs(read(valueText(sensor, value)) - value), String(value)).toBeLessThan(slack);
    expect(differenceNumber(sensor, value)).toBe(valueText(sensor, value));
  }
});

test('all values of a sensor have as many digits, whatever their size', () => {
  const texts = (name: string, ...values: number[]): string[] =>
    values.map((value) => valueText(sensorNamed(name), value));
  expect(texts('temperature', 0.4, 9.96, 20.25, -0.04)).toEqual(['0.4', '10.0', '20.3', '0.0']);
  expect(texts('vpd', 0.04, 1.1, 12)).toEqual(['0.04', '1.10', '12.00']);
  expect(texts('co2', 0, 99.6, 1_499.6)).toEqual(['0', '100', '1,500']);
  expect(texts('humidity', 0.4, 100)).toEqual(['0.4', '100.0']);
  // Without their own ranges, as precise as the sensors that they are computed from.
  expect(texts('dew_point', 0.4, 12)).toEqual(['0.4', '12.0']);
  expect(texts('co2_dose', 80.4, 800)).toEqual(['80', '800']);
});

test('a value at its limit is on neither side of it', () => {
  expect(beyondLimitText(sensorNamed('temperature'), 10, 10)).toBe('10.0\u00a0°C');
});
