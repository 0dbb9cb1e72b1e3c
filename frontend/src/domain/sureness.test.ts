import { describe, expect, test } from 'vitest';

import { estimated, sureness } from '../testing/field';
import {
  errorField,
  errorShade,
  estimatedField,
  NOT_KNOWN_STEP,
  onExplored,
  stepOf,
  STEPS,
} from './sureness';

describe('how sure a cell is', () => {
  test('goes by steps of the error, each at its limit', () => {
    STEPS.forEach((step, index) => {
      expect(stepOf(step * 2 - 1e-9, 2)).toBe(index);
      expect(stepOf(step * 2, 2)).toBe(index + 1);
    });
    expect(stepOf(NaN, 2)).toBe(NOT_KNOWN_STEP);
    // A house of which nobody says what would be known.
    expect(stepOf(0, 0)).toBe(NOT_KNOWN_STEP);
  });

  test('the error alone is told also where the value is not known, and nowhere else', () => {
    const sd = [1, 2, NaN];
    const error = errorField(estimated([20, NaN, NaN], sd), sureness(sd));
    expect([...error.values].map((value) => Number(value.toFixed(3)))).toEqual([1.645, 3.29, NaN]);
    expect([error.valueMin, error.valueMax]).toEqual([0, error.values[1]]);
  });

  test('more error is more colour, and none is still to be seen', () => {
    const alpha = (value: number): number => {
      const data = new Uint8ClampedArray(4);
      errorShade({ low: 0, high: 2 })(data, 0, value, 0);
      return data[3] ?? 0;
    };
    expect(alpha(0)).toBeGreaterThan(0);
    expect(alpha(1)).toBeGreaterThan(alpha(0));
    expect(alpha(2)).toBeGreaterThan(alpha(1));
  });
});

describe('the field of an estimate', () => {
  const grid = { width: 3, height: 1, originX: 0, originY: 0, resolution: 1 };
  const counts = { sdKnown: 1, sampleCount: 3, readingCount: 40 };

  test('what is too unsure is not known, and has no say in the range', () => {
    const mean = Float32Array.of(20, 22, 90);
    const sd = Float32Array.of(0.5, 1.4, 1.5);
    const field = estimatedField('co2', { ...grid, ...counts, mean, sd });
    expect([...field.values]).toEqual([20, 22, NaN]);
    expect([field.valueMin, field.valueMax]).toEqual([20, 22]);
    expect([...(field.sureness?.sd ?? [])]).toEqual([...sd]);
  });

  test('of nothing known there is no range', () => {
    const mean = Float32Array.of(20, 22, NaN);
    const sd = Float32Array.of(9, 9, NaN);
    const field = estimatedField('co2', { ...grid, ...counts, mean, sd });
    expect([field.valueMin, field.valueMax]).toEqual([0, 0]);
  });
});

/** Two by two pixels of 1 m from (1, 0) on, of which the one at the lower left is explored. */
const map = (yaw = 0): Parameters<typeof onExplored>[1] => {
  const data = new Uint8ClampedArray(16);
  data[2 * 4 + 3] = 255;
  return {
    placement: { originX: 1, originY: 0, yaw, resolution: 1, width: 2, height: 2 },
    pixels: { data, width: 2, height: 2 },
  };
};
const known = (values: Float32Array | undefined): boolean[] =>
  [...(values ?? [])].map((value) => !Number.isNaN(value));

test('an estimate ends where the map does, and where nothing is explored', () => {
  const clipped = onExplored(estimated([20, 21, 22, 23], [1, 1, 1, 1]), map());
  expect(known(clipped.values)).toEqual([false, true, false, false]);
  expect(known(clipped.sureness?.sd)).toEqual([false, true, false, false]);
  // A quarter turn about the corner: the explored pixel then lies before it.
  const turned = onExplored(estimated([20, 21, 22, 23], [1, 1, 1, 1]), map(Math.PI / 2));
  expect(known(turned.values)).toEqual([true, false, false, false]);
});

test('what the twin has clipped already stays the same', () => {
  const { sureness, ...field } = estimated([20, 21], [1, 1]);
  expect(sureness).toBeDefined();
  expect(onExplored(field, map())).toBe(field);
});
