import { expect, test } from 'vitest';

import { CATALOGUE, FILE } from '../testing/sensors';
import { cataloguesOf } from '../domain/sensors';
import { seriesWith } from '../testing/series';
import { modelOf, pairKey } from './model';

test('the band is that of the plants, and of several kinds there is none', () => {
  const plan = { sensor: 'temperature', tagIds: ['1', '2'] };
  const series = new Map(
    plan.tagIds.map((tagId) => [pairKey({ tagId, sensor: plan.sensor }), seriesWith({ tagId })]),
  );
  const of = (...species: string[]) => {
    const lines = { series, before: new Map(), marks: new Map() };
    const span = { from: 0, to: 100 };
    return modelOf(CATALOGUE, cataloguesOf(FILE), plan, species, lines, span, 'C', null, null);
  };
  const ideals = (...species: string[]) => of(...species).bands.map(({ ranges }) => ranges.ideal);
  expect(ideals('', 'fern')).toEqual([[18, 26]]);
  expect(ideals('Tulip', 'tulip')).toEqual([[12, 20]]);
  expect(of('Tulip', 'tulip').isMixed).toBe(false);
  expect(ideals('tulip', '')).toEqual([]);
  expect(of('tulip', '').isMixed).toBe(true);
});
