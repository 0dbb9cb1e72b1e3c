import { expect, test } from 'vitest';

import { mapPoint } from '../geometry/coordinates';
import { judgement, reason } from '../testing/health';
import { sensorNamed } from '../testing/sensors';
import { readings, wireTag } from '../testing/tags';
import {
  cellsWhere,
  IDEAL_ALPHA,
  idealColour,
  idealShade,
  oldCells,
  rangesAt,
  readSites,
  type Site,
  withOld,
  zonesOf,
} from './ideal';
import type { Shade } from './ramp';
import { rangesFor } from './sensors';
import { type Tag, tagOf } from './twin';

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
  const data = new Uint8ClampedArray(8);
  const shade = idealShade(zones);
  const row = 10 * grid.width;
  shade(data, 0, 22, row);
  shade(data, 4, 22, row + grid.width - 1);
  const alpha = Math.round(255 * IDEAL_ALPHA);
  expect([...data]).toEqual([...idealColour(0.25), alpha, ...idealColour(0), alpha]);
});

const vpd = sensorNamed('vpd');
const old = (sensor: string): ReturnType<typeof reason> =>
  reason({ kind: 'old', verdict: 'unknown', sensor, value: null, limit: 600 });
const tag = (id: string, x: number, said: Parameters<typeof readings>[0]): Tag =>
  tagOf(
    wireTag({
      tag_id: id,
      pose: { position: { x, y: 0.5, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } },
      readings: readings(said),
    }),
    { at: { sec: 100, nanosec: 0 }, takenAt: 0 },
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

test('what is derived is old where all that it is made of is', () => {
  const both = { temperature: 22, humidity: 60, co2: 600 };
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
  // Tag by cell it would be 400 million.
  expect(looks).toBeLessThan(12 * side * side);
});

test('what is too old is faint under its hatching, and bare where nothing is hatched', () => {
  const shade: Shade = (data, at) => {
    data.set([1, 2, 3, 200], at);
  };
  const painted = (isHatched: boolean): number[] => {
    const data = new Uint8ClampedArray(8);
    const mixed = withOld(shade, Uint8Array.of(0, 1), isHatched);
    mixed(data, 0, 22, 0);
    mixed(data, 4, 22, 1);
    return [...data];
  };
  expect(painted(true)).toEqual([1, 2, 3, 200, 1, 2, 3, 44]);
  expect(painted(false)).toEqual([1, 2, 3, 200, 0, 0, 0, 0]);
});

test('a part of a field has its other cells not known', () => {
  const field = {
    ...{ ...row, width: 3, sensor: 'co2', valueMin: 1, valueMax: 3, sampleCount: 1 },
    values: Float32Array.of(1, 2, NaN),
  };
  expect([...cellsWhere(field, (cell) => cell > 0).values]).toEqual([NaN, 2, NaN]);
});
