import { describe, expect, test } from 'vitest';

import type { Field } from '../contract/types';
import { mapPoint } from '../geometry/coordinates';
import { estimated, fieldWith, sureness } from '../testing/field';
import { sensorNamed } from '../testing/sensors';
import {
  edgesOf,
  errorField,
  errorShade,
  estimatedField,
  fieldCorners,
  fieldPixels,
  finer,
  NOT_KNOWN_STEP,
  onExplored,
  resolutionFor,
  stepOf,
  STEPS,
  valueAt,
} from './field';
import { fieldShade } from './ramp';

const red = sensorNamed('temperature');

const field = (rows: readonly (readonly number[])[]): Field =>
  fieldWith(rows, { originX: 10, originY: -2, resolution: 0.5 });

/** Row 0, the lowest y, is written first. */
const small = field([
  [0, 5, 10],
  [NaN, 2, 4],
]);
const range = { low: 0, high: 10 };
const alpha = (data: Uint8ClampedArray, pixel: number): number => data[pixel * 4 + 3] ?? -1;

describe('value under a point', () => {
  test('is that of the cell which holds it', () => {
    expect(valueAt(small, mapPoint(10.01, -1.99))).toBe(0);
    expect(valueAt(small, mapPoint(10.51, -1.51))).toBe(5);
    expect(valueAt(small, mapPoint(11.49, -1.01))).toBe(4);
  });

  test('is unknown for NaN and outside', () => {
    expect(valueAt(small, mapPoint(10.2, -1.2))).toBeNull();
    expect(valueAt(small, mapPoint(9.99, -1.9))).toBeNull();
    expect(valueAt(small, mapPoint(11.51, -1.9))).toBeNull();
    expect(valueAt(small, mapPoint(10.2, -0.99))).toBeNull();
  });
});

describe('picture', () => {
  test('has row 0 at the bottom', () => {
    const { data, width, height } = fieldPixels(small, fieldShade(red, range));
    expect([width, height]).toEqual([3, 2]);
    expect(alpha(data, 5)).toBe(Math.round(255 * 0.6));
    expect([...data.slice(5 * 4, 5 * 4 + 3)]).toEqual([219, 60, 36]);
  });

  test('is transparent at the minimum and where nothing is known', () => {
    const { data } = fieldPixels(small, fieldShade(red, range));
    expect(alpha(data, 0)).toBe(0);
    expect(alpha(data, 3)).toBe(0);
  });
});

test('cells stay few enough, and no finer than 5 cm', () => {
  expect(resolutionFor({ minX: 0, minY: 0, maxX: 7, maxY: 11 }, 60_000)).toBe(0.05);
  const large = { minX: 0, minY: 0, maxX: 100, maxY: 60 };
  const step = resolutionFor(large, 60_000);
  expect(step).toBe(0.5);
  expect(6000 / step ** 2).toBeLessThanOrEqual(60_000);
});

test('the grid reaches from its origin over all of its cells', () => {
  expect(fieldCorners(small)).toEqual([mapPoint(10, -2), mapPoint(11.5, -1)]);
});

const outlined = (rows: readonly (readonly number[])[]): Field =>
  fieldWith(rows, { originX: 10, originY: 20, resolution: 0.5 });

test('the outline cuts corners, also around a hole; what is not known at all has none', () => {
  expect(edgesOf(outlined([[NaN, 1]]))).toEqual([
    ...[10.75, 20, 10.5, 20.25],
    ...[11, 20.25, 10.75, 20],
    ...[10.5, 20.25, 10.75, 20.5],
    ...[11, 20.25, 10.75, 20.5],
  ]);
  const ring = [
    [1, 1, 1],
    [1, NaN, 1],
    [1, 1, 1],
  ];
  expect(edgesOf(outlined(ring))).toHaveLength(4 * (4 + 12));
  expect(edgesOf(outlined([[NaN, NaN]]))).toEqual([]);
});

describe('finer cells', () => {
  const [own, third] = [4, 1 / 3];
  /** The parts of a cell, the lowest row first, of a grid that is three cells wide. */
  const partsOf = (values: Float32Array, x: number, y: number): number[] =>
    [0, 1, 2].flatMap((row) => [...values.slice((y * 3 + row) * 9 + x * 3).slice(0, 3)]);

  test('are interpolated, with each cell’s own value at its centre', () => {
    const fine = finer(
      field([
        [0, 3, 6],
        [0, 3, 6],
      ]),
    );
    expect([fine.width, fine.height, fine.resolution]).toEqual([9, 6, 0.5 * third]);
    expect([...fine.values.slice(0, 9)].map(Math.round)).toEqual([0, 0, 1, 2, 3, 4, 5, 6, 6]);
  });

  test('never show a value at the centre of an unknown cell, and always at that of a known one', () => {
    const rows = [
      [1, 1, 1],
      [1, NaN, 1],
      [1, 1, 1],
    ];
    const hole = finer(field(rows)).values;
    expect(partsOf(hole, 1, 1)[own]).toBeNaN();
    expect(partsOf(hole, 0, 1)).not.toContain(NaN);
    const alone = finer(field(rows.map((row) => row.map((value) => (value === 1 ? NaN : 1)))));
    expect(partsOf(alone.values, 1, 1)[own]).toBe(1);
    expect(partsOf(alone.values, 0, 1)).toEqual(Array(9).fill(NaN));
  });

  test('round the corners of what is known, also of an estimate’s error', () => {
    const rows = [
      [1, 1, NaN],
      [1, 1, NaN],
      [NaN, NaN, NaN],
    ];
    const given = { ...field(rows), sureness: sureness(rows.flat()) };
    const { values, sureness: fine } = finer(given);
    expect(
      partsOf(values, 1, 1)
        .map((value) => Number.isNaN(value))
        .slice(4),
    ).toEqual([false, true, true, true, true]);
    expect(fine?.sd).toEqual(values);
  });
});

describe('how sure a cell is', () => {
  test('goes by steps of the error, each at its limit', () => {
    STEPS.forEach((step, index) => {
      expect(stepOf(step * 2 - 1e-9, 2)).toBe(index);
      expect(stepOf(step * 2, 2)).toBe(index + 1);
    });
    expect(stepOf(NaN, 2)).toBe(NOT_KNOWN_STEP);
    // Without a limit for known cells.
    expect(stepOf(0, 0)).toBe(NOT_KNOWN_STEP);
  });

  test('the error is shown also where the value is not known', () => {
    const sd = [1, 2, NaN];
    const error = errorField(estimated([20, NaN, NaN], sd), sureness(sd));
    expect([...error.values].map((value) => Number(value.toFixed(3)))).toEqual([1.645, 3.29, NaN]);
    expect([error.valueMin, error.valueMax]).toEqual([0, error.values[1]]);
  });

  test('more error is more colour, and none is still to be seen', () => {
    const alpha = (value: number): number => errorShade({ low: 0, high: 2 })(value, 0).alpha;
    expect(alpha(0)).toBeGreaterThan(0);
    expect(alpha(1)).toBeGreaterThan(alpha(0));
    expect(alpha(2)).toBeGreaterThan(alpha(1));
  });
});

describe('the field of an estimate', () => {
  const grid = { width: 3, height: 1, originX: 0, originY: 0, resolution: 1 };
  const counts = { sdKnown: 1, sampleCount: 3 };

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
    pixels: { data, width: 2, height: 2 } as ImageData,
  };
};
const known = (values: Float32Array | undefined): boolean[] =>
  [...(values ?? [])].map((value) => !Number.isNaN(value));

test('an estimate ends where the map does, and where nothing is explored', () => {
  const clipped = onExplored(estimated([20, 21, 22, 23], [1, 1, 1, 1]), map());
  expect(known(clipped.values)).toEqual([false, true, false, false]);
  expect(known(clipped.sureness?.sd)).toEqual([false, true, false, false]);
  // Rotated by 90° about the corner: the explored pixel is then on its other side.
  const turned = onExplored(estimated([20, 21, 22, 23], [1, 1, 1, 1]), map(Math.PI / 2));
  expect(known(turned.values)).toEqual([true, false, false, false]);
});

test('so does a field of the nearest readings, which has no error', () => {
  const { sureness, ...field } = estimated([20, 21, 22, 23], [1, 1, 1, 1]);
  expect(sureness).toBeDefined();
  const clipped = onExplored(field, map());
  expect([known(clipped.values), clipped.sureness]).toEqual([
    [false, true, false, false],
    undefined,
  ]);
});
