import { expect, test } from 'vitest';

import { mapPoint } from '../geometry/coordinates';
import { sensorNamed } from '../testing/sensors';
import { IDEAL_ALPHA, idealColour } from './ideal';
import { rangesFor } from './sensors';
import { idealShade, rangesAt, zonesOf, type Site } from './zones';

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
