import { beforeEach, describe, expect, test } from 'vitest';

import { showTags } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import { act, receive, store } from './app';
import { selectHealth, selectRange, selectSensors } from './derived';

beforeEach(() => {
  showTags([
    wireTag({ tag_id: '1', readings: readings({ temperature: 20, ph: 7 }) }),
    wireTag({ tag_id: '2', readings: readings({ temperature: 30 }) }),
  ]);
});

describe('range in use', () => {
  test('is the readings’ while there is no field', () => {
    expect(selectRange(store.get())).toEqual({ low: 20, high: 30 });
    expect(selectRange(store.get())).toBe(selectRange(store.get()));
  });

  test('a fixed one comes before all', () => {
    act({ type: 'range', range: { low: 0, high: 50 } });
    expect(selectRange(store.get())).toEqual({ low: 0, high: 50 });
  });

  test('is the field’s where there is one for this sensor', () => {
    const value = {
      sensor: 'temperature',
      width: 1,
      height: 1,
      originX: 0,
      originY: 0,
      resolution: 1,
      valueMin: 21,
      valueMax: 29,
      sampleCount: 2,
      values: Float32Array.of(25),
    };
    receive({ type: 'field', field: { value, state: 'ready', message: '' } });
    expect(selectRange(store.get())).toEqual({ low: 21, high: 29 });
    act({ type: 'sensor', sensor: 'ph' });
    expect(selectRange(store.get())).toEqual({ low: 7, high: 7 });
    act({ type: 'sensor', sensor: 'co2' });
    expect(selectRange(store.get())).toBeNull();
  });
});

test('an undeclared sensor that a tag reports can be chosen', () => {
  expect(selectSensors(store.get()).map(({ name }) => name)).toContain('ph');
  expect(selectSensors(store.get())).toBe(selectSensors(store.get()));
});

test('health is worked out once a snapshot', () => {
  expect(selectHealth(store.get())).toBe(selectHealth(store.get()));
  expect(selectHealth(store.get()).byTag.size).toBe(2);
});
