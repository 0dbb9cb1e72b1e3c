import { describe, expect, test } from 'vitest';

import { cataloguesOf, type Ranges } from '../domain/sensors';
import type { Series } from '../domain/series';
import { CATALOGUE, FILE, sensorNamed } from '../testing/sensors';
import { bucketAt, seriesWith } from '../testing/timeline';
import {
  aligned,
  bandsOf,
  drawnOf,
  limitsOf,
  modelOf,
  type PlotModel,
  pointsOf,
  valueRange,
} from './model';

const model = (all: readonly Series[], over: Partial<PlotModel> = {}): PlotModel => ({
  sensor: sensorNamed('temperature'),
  lines: all.map((each, look) => ({
    series: each,
    before: null,
    look,
    label: each.tagId,
    marks: [],
  })),
  span: { from: 0, to: 100 },
  bands: [{ from: 0, to: 100, ranges: over.sensor ?? sensorNamed('temperature') }],
  isMixed: false,
  moment: null,
  ...over,
});

describe('the ranges of day and night', () => {
  const ranges = {
    now: { ideal: [18, 26], critical: null },
    day: { ideal: [20, 28], critical: null },
    night: { ideal: [15, 24], critical: null },
  } as const;
  const nameOf = (of: Ranges): string | undefined =>
    (['now', 'day', 'night'] as const).find((name) => ranges[name] === of);
  const bands = (
    from: number,
    to: number,
    nights: readonly [number, number][] | null,
    at: number | null = null,
  ): unknown =>
    bandsOf(
      { from, to },
      nights?.map(([dusk, dawn]) => ({ from: dusk, to: dawn })) ?? null,
      ranges,
      at,
    ).map((band) => [band.from, band.to, nameOf(band.ranges)]);

  test('follow each other over the whole span', () => {
    expect(
      bands(0, 100, [
        [-10, 10],
        [40, 60],
        [90, 120],
      ]),
    ).toEqual([
      [0, 10, 'night'],
      [10, 40, 'day'],
      [40, 60, 'night'],
      [60, 90, 'day'],
      [90, 100, 'night'],
    ]);
  });

  test('are one where it was day, or night, all of the time', () => {
    expect(bands(0, 100, [])).toEqual([[0, 100, 'day']]);
    expect(bands(0, 100, [[-10, 120]])).toEqual([[0, 100, 'night']]);
    // The span has moved on since the nights were received.
    expect(bands(50, 150, [[0, 40]])).toEqual([[50, 150, 'day']]);
  });

  test('are those of the moment where no clock tells', () => {
    expect(bands(0, 100, null)).toEqual([[0, 100, 'now']]);
  });

  test('are, around the moment, those that its verdicts have, whatever the clock says', () => {
    expect(bands(0, 100, [[60, 120]], 100)).toEqual([
      [0, 60, 'day'],
      [60, 100, 'now'],
    ]);
    expect(bands(0, 100, [[60, 120]], 30)).toEqual([
      [0, 60, 'now'],
      [60, 100, 'night'],
    ]);
    // In a period that has ended, no reading is judged now.
    expect(bands(0, 100, [], 150)).toEqual([[0, 100, 'day']]);
  });
});

test('the day before is drawn below all lines, in the look of its own', () => {
  const [today, before] = [20, 15].map((value) => seriesWith({ readings: [{ at: 10, value }] }));
  const two = model([seriesWith({}), today ?? seriesWith({})]);
  const lines = two.lines.map((line, index) =>
    index ? { ...line, before: before ?? null } : line,
  );
  const all = { ...two, lines };
  expect(drawnOf(all).map(({ look, isBefore }) => [look, isBefore])).toEqual([
    [1, true],
    [0, false],
    [1, false],
  ]);
  expect(aligned(all)).toEqual([[10], [15], [undefined], [20]]);
  expect(valueRange(all)[0]).toBeLessThan(15);
});

const same = (value: number): number => value;

describe('the points of a line', () => {
  test('break in each gap, and at a reading that is no number', () => {
    const readings = [
      { at: 10, value: 20 },
      { at: 20, value: null },
      { at: 80, value: 21 },
    ];
    const gaps = [{ from: 20, to: 80 }];
    expect(pointsOf(seriesWith({ readings, gaps }), same)).toEqual([
      { at: 10, value: 20 },
      { at: 20, value: null },
      { at: 50, value: null },
      { at: 80, value: 21 },
    ]);
  });

  test('of buckets are their means, in their middle', () => {
    expect(pointsOf(seriesWith({ bucketS: 10, points: [bucketAt(40, 21)] }), same)).toEqual([
      { at: 45, value: 21 },
    ]);
  });
});

describe('several lines over common times', () => {
  const one = seriesWith({
    readings: [
      { at: 10, value: 20 },
      { at: 30, value: 30 },
    ],
  });
  const other = seriesWith({
    tagId: '2',
    readings: [{ at: 20, value: 10 }],
    gaps: [{ from: 20, to: 40 }],
  });

  test('are bridged where another has a time, and broken at their own gaps', () => {
    expect(aligned(model([one, other]))).toEqual([
      [10, 20, 30],
      [20, undefined, 30],
      [undefined, 10, null],
    ]);
  });

  test('are in the unit that is shown', () => {
    expect(aligned(model([one], { sensor: sensorNamed('temperature', 'F') }))).toEqual([
      [10, 30],
      [68, 86],
    ]);
  });

  test('may have nothing at all', () => {
    expect(aligned(model([seriesWith()]))).toEqual([[], []]);
  });
});

describe('the axis of the values', () => {
  const reading = (...values: number[]): Series =>
    seriesWith({ readings: values.map((value, at) => ({ at, value })) });

  test('takes the least and the most of buckets, not their means alone', () => {
    const points = [{ at: 0, n: 9, value: 21, min: 10, max: 40 }];
    const [low, high] = valueRange(model([seriesWith({ bucketS: 10, points })]));
    expect(low).toBeCloseTo(10 - 30 * 0.08);
    expect(high).toBeCloseTo(40 + 30 * 0.08);
  });

  test('takes the ideal range in while the values keep their share of the height', () => {
    // Ideal is 50 to 85, and values that spread over 14 of these 35 keep 40 %.
    const humidity = { sensor: sensorNamed('humidity') };
    expect(valueRange(model([reading(60, 74)], humidity))[1]).toBeCloseTo(85 + 35 * 0.08);
    expect(valueRange(model([reading(60, 73.9)], humidity))[1]).toBeLessThan(85);
    // Below it, the critical limit of 10 is included, though 18 is too far off.
    expect(valueRange(model([reading(5.6, 8.2)]))[1]).toBeCloseTo(10 + 4.4 * 0.08);
    expect(valueRange(model([reading(19, 25)]))[0]).toBeGreaterThan(10);
    // Far above it, the ideal range stays out.
    expect(valueRange(model([reading(40, 44)]))[0]).toBeGreaterThan(26);
  });

  test('is of what was read, however far what is ideal reaches', () => {
    const light = { sensor: sensorNamed('light') };
    const [low, high] = valueRange(model([reading(750, 900)], light));
    expect([low, high]).toEqual([738, 912]);
    // Nor do values that are never negative get a negative half.
    expect(valueRange(model([reading(0, 0)], light))).toEqual([-0.08, 1.08]);
  });

  test('makes no mountains of noise, and has one without any reading', () => {
    const [low, high] = valueRange(model([reading(22, 22)]));
    expect(high - low).toBeGreaterThan(0.8);
    expect(valueRange(model([seriesWith()]))[0]).toBeLessThan(18);
    const unknown = { sensor: sensorNamed('spin') };
    expect(valueRange(model([reading(0, 0)], unknown))[1]).toBeGreaterThan(0.5);
    expect(valueRange(model([seriesWith()], unknown))).toEqual([-0.08, 1.08]);
  });

  test('is in the unit that is shown', () => {
    expect(
      valueRange(model([seriesWith()], { sensor: sensorNamed('temperature', 'F') }))[0],
    ).toBeCloseTo((18 - 0.64) * 1.8 + 32);
  });
});

describe('the limits that are named', () => {
  const named = (...values: number[]): unknown[] => {
    const readings = values.map((value, at) => ({ at, value }));
    return limitsOf(model([seriesWith({ readings })])).map(({ kind, value, side }) => [
      kind,
      value,
      side,
    ]);
  };

  test('are those in the picture, and where what is ideal lies beyond it', () => {
    expect(named(12, 24)).toEqual([
      ['ideal', 18, 'inside'],
      ['ideal', 26, 'inside'],
      ['critical', 10, 'inside'],
    ]);
    expect(named(6, 10)).toEqual([
      ['ideal', 18, 'above'],
      ['critical', 10, 'inside'],
    ]);
    expect(named(40, 44)).toEqual([
      ['ideal', 26, 'below'],
      ['critical', 35, 'inside'],
    ]);
    expect(named(21, 22)).toEqual([
      ['ideal', 18, 'below'],
      ['ideal', 26, 'above'],
    ]);
  });
});

test('the band is that of the plants, and of several kinds there is none', () => {
  const tagIds = ['1', '2'];
  const of = (...species: string[]) => {
    const marks = [-3, -1, 98].map((at) => ({ at, widthS: 4, kind: 'failure' as const, count: 1 }));
    const lines = tagIds.map((tagId) => ({ series: seriesWith({ tagId }), before: null, marks }));
    const both = cataloguesOf(FILE);
    const span = { from: 0, to: 100 };
    return modelOf(CATALOGUE, both, 'temperature', tagIds, species, lines, span, null, null);
  };
  const ideals = (...species: string[]) => of(...species).bands.map(({ ranges }) => ranges.ideal);
  expect(ideals('', 'fern')).toEqual([[18, 26]]);
  expect(ideals('Tulip', 'tulip')).toEqual([[12, 20]]);
  expect(of('Tulip', 'tulip').isMixed).toBe(false);
  expect(ideals('tulip', '')).toEqual([]);
  expect(of('tulip', '').isMixed).toBe(true);
  // Buckets may begin before the period, and end after it.
  expect(of('').lines[0]?.marks.map(({ at }) => at)).toEqual([-1, 98]);
});
