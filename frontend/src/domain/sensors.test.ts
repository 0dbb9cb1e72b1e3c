import { describe, expect, test } from 'vitest';

import { CATALOGUE, CATALOGUES, FILE, sensorNamed } from '../testing/sensors';
import { cataloguesOf, isHad, isMeasured, NO_CATALOGUES, rangesFor } from './sensors';
import { toShown } from './format';

test('every look comes from the file, in its order', () => {
  expect(CATALOGUE.all.map(({ name }) => name)).toEqual(Object.keys(FILE.sensors));
  for (const [name, { label, unit, hue, lightness }] of Object.entries(FILE.sensors)) {
    expect(sensorNamed(name)).toMatchObject({ name, label, unit, hue, lightness });
  }
  const { saturation, max_alpha: maxAlpha } = FILE.ramp;
  expect(sensorNamed('co2')).toMatchObject({ saturation, maxAlpha });
});

test('an undeclared sensor shows its own name, is never judged, and stays the same', () => {
  expect(sensorNamed('ph')).toMatchObject({ name: 'ph', label: 'ph', unit: '', ideal: null });
  expect(sensorNamed('ph')).toBe(sensorNamed('ph'));
});

test('what some tag reports is offered: declared sensors first, then the others by name, each once', () => {
  const names = CATALOGUE.with(['zinc', 'humidity', 'ph', 'zinc', 'co2']).map(({ name }) => name);
  expect(names).toEqual(['humidity', 'co2', 'ph', 'zinc']);
});

test('what follows from two sensors is offered where both are reported', () => {
  const names = CATALOGUE.with(['humidity', 'temperature']).map(({ name }) => name);
  expect(names).toEqual(['temperature', 'humidity', 'vpd', 'dew_point', 'condensation_margin']);
});

test('what is of a day is offered by charts, and else only while it is in view', () => {
  const offered = (...reported: string[]): string[] =>
    CATALOGUE.with(reported).map(({ name }) => name);
  expect(offered()).not.toContain('co2_dose');
  expect(offered('co2_dose').filter((name) => name === 'co2_dose')).toEqual(['co2_dose']);
  expect(offered('co2_dose')).not.toContain('daily_light_integral');
});

test('a sensor is called what the file calls it in that language, else its label, else its name', () => {
  const { day: german } = cataloguesOf(FILE, 'C', 'de');
  expect(german.named('humidity')).toMatchObject({ label: 'Luftfeuchte', dataLabel: 'Humidity' });
  expect(german.named('co2')).toMatchObject({ label: 'CO₂', dataLabel: 'CO₂' });
  expect(german.named('ph')).toMatchObject({ label: 'ph', dataLabel: 'ph' });
  expect(cataloguesOf(FILE, 'C', 'fr').day.named('humidity').label).toBe('Humidity');
});

test('the file says what is derived', () => {
  const derived = CATALOGUE.all.filter((sensor) => !isMeasured(sensor));
  expect(derived.map(({ name }) => name)).toEqual([
    ...['vpd', 'dew_point', 'condensation_margin', 'daily_light_integral', 'temperature_24h_mean'],
    ...['temperature_night_minimum', 'day_night_difference', 'growing_degree_days', 'co2_dose'],
  ]);
  expect(sensorNamed('vpd').madeOf).toEqual(['temperature', 'humidity']);
  expect(sensorNamed('daily_light_integral').madeOf).toEqual(['light']);
});

test('a tag has what it measures, and what is computed of all that it measures', () => {
  const has = (name: string, ...measured: string[]): boolean =>
    isHad(sensorNamed(name), (each) => measured.includes(each));
  expect(has('light', 'light')).toBe(true);
  expect(has('light', 'co2')).toBe(false);
  expect(has('ph')).toBe(false);
  expect(has('daily_light_integral', 'light')).toBe(true);
  expect(has('daily_light_integral', 'temperature')).toBe(false);
  expect(has('vpd', 'temperature')).toBe(false);
  expect(has('vpd', 'temperature', 'humidity')).toBe(true);
  expect(has('vpd', 'vpd')).toBe(true);
});

describe('ranges', () => {
  const file = {
    ...FILE,
    sensors: {
      heat: {
        ...FILE.fallback,
        ideal: [18, 26],
        critical: [10, 35],
        night: { ideal: [15, 24] },
        species: { Orchid: { ideal: [20, 28], night: { ideal: null } }, moss: { ideal: null } },
      },
      damp: { ...FILE.fallback, ideal: [40, 60] },
    },
  };
  const { day, night } = cataloguesOf(file);

  test('are those of the day or of the night; of a night that says nothing, the day\u2019s', () => {
    expect(day.named('heat')).toMatchObject({ ideal: [18, 26], critical: [10, 35] });
    expect(night.named('heat')).toMatchObject({ ideal: [15, 24], critical: null });
    expect(night.named('damp')).toMatchObject({ ideal: [40, 60] });
    expect([day, night].map((each) => each.named('heat').part)).toEqual(['day', 'night']);
    expect([day, night].map((each) => each.named('damp').part)).toEqual([null, null]);
  });

  test('a species has its own, or none, or those of all', () => {
    expect(rangesFor(day.named('heat'), 'ORCHID').ideal).toEqual([20, 28]);
    expect(rangesFor(night.named('heat'), 'orchid').ideal).toBeNull();
    expect(rangesFor(day.named('heat'), 'moss').ideal).toBeNull();
    expect(rangesFor(day.named('heat'), 'rose').ideal).toEqual([18, 26]);
  });

  test('before the bridge has answered, nothing is judged', () => {
    expect(NO_CATALOGUES.day.all).toEqual([]);
    expect(NO_CATALOGUES.day.named('temperature')).toMatchObject({
      label: 'temperature',
      ideal: null,
    });
    expect(CATALOGUES.night.named('light').ideal).toBeNull();
  });
});

test.each([
  ['its night', { ideal: [1, 2], night: { ideal: [1, 20] } }, 1],
  ['its species', { ideal: [1, 2], species: { rose: { ideal: [1, 200] } } }, 0],
  ['what lies below zero', { ideal: [-20, 2] }, 1],
  ['no more than six', { ideal: [0, 1e-7] }, 6],
  ['none', { ideal: null }, null],
] as const)('the largest of all limits tells its digits: %s', (_, ranges, digits) => {
  const sensors = { x: { label: 'x', unit: '', hue: 0, lightness: 50, ...ranges } };
  expect(cataloguesOf({ ...FILE, sensors }).day.named('x').digits).toBe(digits);
});

const temperature = sensorNamed('temperature');
const fahrenheit = sensorNamed('temperature', 'F');
const humidity = sensorNamed('humidity', 'F');

test('temperatures follow the operator, other units do not', () => {
  expect(toShown(fahrenheit, 25)).toBe(77);
  expect(toShown(temperature, 25)).toBe(25);
  expect(fahrenheit.unit).toBe('°F');
  expect(toShown(humidity, 25)).toBe(25);
  expect(humidity.unit).toBe('%');
});
