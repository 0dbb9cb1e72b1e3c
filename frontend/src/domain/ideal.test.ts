import { describe, expect, test } from 'vitest';

import { mapPoint } from '../geometry/coordinates';
import { judgement, reason } from '../testing/health';
import { THEMES } from '../testing/colours';
import { sensorNamed } from '../testing/sensors';
import { readings, wireTag } from '../testing/tags';
import {
  beyond,
  cellsWhere,
  excess,
  IDEAL_ALPHA,
  idealColour,
  idealShade,
  idealText,
  oldCells,
  rangesAt,
  readSites,
  type Site,
  withOld,
  zonesOf,
} from './ideal';
import { mix, type Rgb, type Shade } from './ramp';
import { rangesFor } from './sensors';
import { type Tag, tagOf } from './twin';

const ranges = { ideal: [18, 26], critical: [10, 35] } as const;

test.each([
  [18, 0],
  [26, 0],
  [17.9, -0.1],
  [27, 1],
])('%f lies %f beyond', (value, by) => {
  expect(beyond(ranges, value)).toBeCloseTo(by);
});

describe('excess', () => {
  test.each([
    [22, 0],
    [14, -0.5],
    [10, -1],
    [3, -1],
    [30.5, 0.5],
    [35, 1],
  ])('of %f is %f', (value, share) => {
    expect(excess(ranges, value)).toBeCloseTo(share);
  });

  test('without a critical limit ends at half of the ideal width; of no ideal there is none', () => {
    expect(excess({ ideal: [0, 10], critical: null }, 12.5)).toBe(0.5);
    expect(excess({ ideal: null, critical: null }, 12.5)).toBeNull();
  });

  test('where it is critical at once there is no way between', () => {
    expect(excess({ ideal: [0, 10], critical: [0, 10] }, 10.1)).toBe(1);
    expect(excess({ ideal: [0, 10], critical: [0, 10] }, -0.1)).toBe(-1);
  });
});

describe('words', () => {
  const described = (name: string, value: number, unit: 'C' | 'F' = 'C'): string | null => {
    const sensor = sensorNamed(name, unit);
    return idealText(sensor, sensor, value);
  };

  test.each([
    ['temperature', 18, 'C', 'ideal'],
    ['temperature', 16, 'C', 'too low by 2.0\u00a0°C'],
    ['temperature', 27, 'F', 'too high by 1.8\u00a0°F'],
    ['temperature', 26.000_01, 'C', 'too high'],
    ['dew_point', 5, 'C', null],
  ] as const)('%s %f %s: %s', (name, value, unit, text) => {
    expect(described(name, value, unit)).toBe(text);
  });
});

/** Machado, Oliveira and Fernandes 2009, severity 1, on linear light. */
const SEEN = {
  normal: [1, 0, 0, 0, 1, 0, 0, 0, 1],
  protanopia: [0.152, 1.053, -0.205, 0.115, 0.786, 0.099, -0.004, -0.048, 1.052],
  deuteranopia: [0.367, 0.861, -0.228, 0.28, 0.673, 0.047, -0.012, 0.043, 0.969],
  tritanopia: [1.256, -0.077, -0.179, -0.078, 0.931, 0.148, 0.005, 0.691, 0.304],
} as const;

/** CIE L*a*b* (D65) of a colour as somebody sees it. */
function lab(colour: Rgb, seen: readonly number[]): [number, number, number] {
  const linear = colour.map((each) => {
    const c = each / 255;
    return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
  });
  const dot = (row: readonly number[], of: readonly number[]): number =>
    row.reduce((sum, weight, index) => sum + weight * (of[index] ?? 0), 0);
  const light = [0, 3, 6].map((at) =>
    Math.max(0, Math.min(1, dot(seen.slice(at, at + 3), linear))),
  );
  const f = (t: number): number => (t > 0.008856 ? Math.cbrt(t) : 7.787 * t + 16 / 116);
  const x = f(dot([0.4124, 0.3576, 0.1805], light) / 0.9505);
  const y = f(dot([0.2126, 0.7152, 0.0722], light));
  const z = f(dot([0.0193, 0.1192, 0.9505], light) / 1.089);
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

describe.each(Object.entries(SEEN))('colours as seen with %s', (_, seen) => {
  test.each(THEMES)('are apart from each other and from the floor, %s', (_, token) => {
    const floor = token('floor');
    const painted = (by: number): Rgb => mix(floor, idealColour(by), IDEAL_ALPHA);
    const all = [floor, painted(-1), painted(-0.01), painted(0), painted(0.01), painted(1)];
    const labs = all.map((colour) => lab(colour, seen));
    const apart = labs.flatMap((a, i) =>
      labs.slice(i + 1).map((b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2])),
    );
    // A difference of 10 is visible at a glance, side by side.
    expect(Math.min(...apart)).toBeGreaterThan(12);
  });
});

const temperature = sensorNamed('temperature');
const grid = { width: 40, height: 30, originX: -1, originY: 2, resolution: 0.1 };
const site = (x: number, y: number, species: string): Site => ({ at: mapPoint(x, y), species });

test('one range for all needs no cells', () => {
  const zones = zonesOf(grid, [site(0, 3, 'rose'), site(1, 3, '')], temperature);
  expect(zones).toEqual({ kinds: [temperature], byCell: null });
  expect(rangesAt(zones, 7)).toBe(temperature);
  expect(zonesOf(grid, [], temperature).kinds).toEqual([temperature]);
});

test('each cell has the ranges of the nearest tag’s plants', () => {
  const sites = [
    ...[site(-0.73, 2.41, 'tulip'), site(1.12, 4.37, 'Orchid'), site(2.9, 2.2, 'rose')],
    ...[site(0.4, 3.3, ''), site(2.2, 4.9, 'TULIP'), site(9, 9, 'orchid')],
  ];
  const zones = zonesOf(grid, sites, temperature);
  let wrong = 0;
  for (let y = 0; y < grid.height; y++) {
    for (let x = 0; x < grid.width; x++) {
      const away = ({ at }: Site): number =>
        Math.hypot(-1 + (x + 0.5) * 0.1 - at.x, 2 + (y + 0.5) * 0.1 - at.y);
      const [first, second] = [...sites].sort((a, b) => away(a) - away(b));
      if (!first || !second) continue;
      const isTie = away(second) - away(first) < 0.02;
      const is = rangesAt(zones, y * grid.width + x);
      if (is !== rangesFor(temperature, first.species) && !isTie) wrong += 1;
    }
  }
  expect(wrong).toBe(0);
});

test('is painted by them: the same value is right here and too high there', () => {
  const zones = zonesOf(grid, [site(-0.9, 3, 'tulip'), site(2.9, 3, 'rose')], temperature);
  const shade = idealShade(zones);
  const row = 10 * grid.width;
  expect(shade(22, row)).toEqual({ rgb: idealColour(0.25), alpha: IDEAL_ALPHA });
  expect(shade(22, row + grid.width - 1)).toEqual({ rgb: idealColour(0), alpha: IDEAL_ALPHA });
});

const vpd = sensorNamed('vpd');
const old = (sensor: string): ReturnType<typeof reason> =>
  reason({ kind: 'old', verdict: 'unknown', sensor, value: null, limit: 600 });
const tag = (id: string, x: number, said: Parameters<typeof readings>[0]): Tag =>
  tagOf(
    wireTag({
      tag_id: id,
      pose: { position: { x, y: 0.5, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } },
      // CO₂ is of a scan before.
      readings: Object.entries(said).flatMap(([name, value]) =>
        readings({ [name]: value }, name === 'co2' ? 50 : 100),
      ),
    }),
  );
const row = { width: 4, height: 1, originX: 0, originY: 0, resolution: 1 };

test('a field is made of the tags that read its sensor, old as the judge says of tag or sensor', () => {
  const tags = [
    tag('all', 1, { temperature: 22, humidity: 60 }),
    tag('this', 2, { temperature: 22 }),
    tag('other', 3, { temperature: 22, co2: 600 }),
    tag('failed', 4, { temperature: null }),
    tag('none', 5, { co2: 600 }),
    tag('not judged', 6, { temperature: 22 }),
    tag('range', 7, { temperature: 2 }),
  ];
  const { tags: said } = judgement({
    all: [old('')],
    this: [old('temperature')],
    other: [old('co2')],
    failed: [old('')],
    none: [old('')],
    range: [reason()],
  });
  expect(readSites(tags, said, temperature).map(({ at, isOld }) => [at.x, isOld])).toEqual([
    [1, true],
    [2, true],
    [3, false],
    [6, false],
    [7, false],
  ]);
});

test('what is derived is old where its scan is', () => {
  const both = { temperature: 22, humidity: 60, vpd: 1.06, co2: 600 };
  const tags = [tag('all', 1, both), tag('two', 2, both), tag('one', 3, both), tag('few', 4, {})];
  const { tags: said } = judgement({
    all: [old('')],
    two: [old('temperature'), old('humidity')],
    one: [old('co2')],
    few: [old('')],
  });
  expect(readSites(tags, said, vpd).map(({ at, isOld }) => [at.x, isOld])).toEqual([
    [1, true],
    [2, true],
    [3, false],
  ]);
  const ofDay = sensorNamed('temperature_night_minimum');
  expect(readSites(tags, said, ofDay).map(({ at, isOld }) => [at.x, isOld])).toEqual([
    [1, true],
    [2, true],
    [3, false],
  ]);
  expect(readSites(tags, said, sensorNamed('daily_light_integral'))).toEqual([]);
});

test('a cell is as old as the nearest reading', () => {
  const tags = [tag('1', 0.5, { temperature: 22 }), tag('2', 3.5, { temperature: 22 })];
  const cells = (said: Parameters<typeof judgement>[0]): number[] | null => {
    const found = oldCells(row, readSites(tags, judgement(said).tags, temperature));
    return found && [...found];
  };
  expect(cells({ 1: [old('')] })).toEqual([1, 1, 0, 0]);
  expect(cells({ 1: [old('')], 2: [old('')] })).toEqual([1, 1, 1, 1]);
  expect(cells({ 1: 'healthy', 2: 'unknown' })).toBeNull();
});

test('thousands of tags cost as little as a few', () => {
  const side = 200;
  let looks = 0;
  const sites = Array.from({ length: 10_000 }, (_, index) => {
    const at = tag('1', (index % 100) / 5, {}).at ?? expect.fail();
    return {
      isOld: index % 2 === 0,
      get at() {
        looks += 1;
        return at;
      },
    };
  });
  const many = { ...row, width: side, height: side, resolution: 0.1 };
  expect(oldCells(many, sites)).toHaveLength(side * side);
  // Comparing each tag with each cell would take 400 million steps.
  expect(looks).toBeLessThan(12 * side * side);
});

test('what is too old is faint under its hatching, and bare where nothing is hatched', () => {
  const shade: Shade = () => ({ rgb: [1, 2, 3], alpha: 0.5 });
  const alphas = (isHatched: boolean): number[] => {
    const mixed = withOld(shade, Uint8Array.of(0, 1), isHatched);
    return [0, 1].map((cell) => mixed(22, cell).alpha);
  };
  expect(alphas(true)).toEqual([0.5, 0.11]);
  expect(alphas(false)).toEqual([0.5, 0]);
});

test('a part of a field has its other cells not known', () => {
  const field = {
    ...{ ...row, width: 3, sensor: 'co2', valueMin: 1, valueMax: 3, sampleCount: 1 },
    values: Float32Array.of(1, 2, NaN),
  };
  expect([...cellsWhere(field, (cell) => cell > 0).values]).toEqual([NaN, 2, NaN]);
});
