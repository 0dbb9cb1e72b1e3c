import { beforeEach, describe, expect, test } from 'vitest';

import { fieldWith } from '../testing/field';
import { showField, showTags } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import { act, store } from './app';
import { selectColumns, selectHealth, selectRange, selectSensors, selectZones } from './derived';

beforeEach(() => {
  showTags([
    wireTag({
      tag_id: '1',
      readings: readings({ temperature: 20, humidity: 60, ph: 7 }),
    }),
    wireTag({ tag_id: '2', readings: readings({ temperature: 30 }) }),
  ]);
});

describe('range in use', () => {
  test('is the readings’ while there is no field', () => {
    expect(selectRange(store.get())).toEqual({ low: 18, high: 30 });
    expect(selectRange(store.get())).toBe(selectRange(store.get()));
  });

  test('is calm while the field’s values come and go at its edge', () => {
    act({ sensor: 'ph' });
    const seen = [7.9, 8.05, 7.9, 8.05, 7.9].map((valueMax) => {
      showField(fieldWith([[6]], { sensor: 'ph', valueMin: 5.2, valueMax }));
      return selectRange(store.get());
    });
    expect(new Set(seen.slice(1)).size).toBe(1);
  });

  test('is the field’s where there is one for this sensor', () => {
    showField(fieldWith([[25]], { valueMin: 21, valueMax: 29 }));
    expect(selectRange(store.get())).toEqual({ low: 18, high: 29 });
    act({ sensor: 'ph' });
    expect(selectRange(store.get())).toEqual({ low: 6.9, high: 7.1 });
    act({ sensor: 'co2' });
    expect(selectRange(store.get())).toBeNull();
  });
});

test('the plants of a place count for its colours where the camera was sure of them', () => {
  const ideals = (confidence: number | null): unknown => {
    showTags([wireTag({ species: 'tulip', species_confidence: confidence })]);
    return selectZones(store.get(), fieldWith([[15]])).kinds.map(({ ideal }) => ideal);
  };
  expect(ideals(0.5)).toEqual([[12, 20]]);
  expect(ideals(0.49)).toEqual([[18, 26]]);
  expect(ideals(null)).toEqual([[18, 26]]);
});

test('an undeclared sensor that a tag reports can be chosen', () => {
  expect(selectSensors(store.get()).map(({ name }) => name)).toContain('ph');
  expect(selectSensors(store.get())).toBe(selectSensors(store.get()));
});

test('health is worked out once a snapshot', () => {
  expect(selectHealth(store.get())).toBe(selectHealth(store.get()));
  expect(selectHealth(store.get()).byTag.size).toBe(2);
});

test('of what is derived, the chosen sensor has a column; a quantity of a day has none', () => {
  const names = (sensors: ReturnType<typeof selectSensors>): string[] =>
    sensors.map(({ name }) => name);
  const air = { temperature: 20, humidity: 60, vpd: 0.94, dew_point: 12 };
  showTags([wireTag({ readings: readings({ ...air, ph: 7 }) })]);
  expect(names(selectSensors(store.get()))).toEqual(
    expect.arrayContaining(['humidity', 'ph', 'vpd']),
  );
  expect(names(selectColumns(store.get()))).toEqual(['temperature', 'humidity', 'ph']);
  expect(selectColumns(store.get())).toBe(selectColumns(store.get()));
  act({ sensor: 'vpd' });
  expect(names(selectColumns(store.get()))).toEqual(['temperature', 'humidity', 'vpd', 'ph']);
  act({ sensor: 'day_night_difference' });
  expect(names(selectColumns(store.get()))).toEqual(['temperature', 'humidity', 'ph']);
});
