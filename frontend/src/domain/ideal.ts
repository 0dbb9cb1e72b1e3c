/** A value against its ideal range: too low, right, too high; in colour and in words. Pure. */
import type { Field, Judgement } from '../contract/types';
import type { MapPoint } from '../geometry/coordinates';
import { S } from '../strings';
import { isOldReading } from './difference';
import { differenceNumber, rangeText, withUnit } from './format';
import { NOT_JUDGED } from './health';
import { speciesText } from './marks';
import { mix, type Rgb, rgbText, type Shade } from './ramp';
import { readingOf, type Ranges, rangesFor, type Sensor, type Span } from './sensors';
import type { Tag } from './twin';

/** Distance beyond the ideal range, in the sensor's unit: below 0 too low, 0 right; null: no ideal. */
export function beyond({ ideal }: Ranges, value: number): number | null {
  if (!ideal) return null;
  const [low, high] = ideal;
  return value < low ? value - low : value > high ? value - high : 0;
}

/**
 * The same from -1 to 1, reached at the critical limit; without one, at half the ideal range's width
 * beyond it.
 */
export function excess(ranges: Ranges, value: number): number | null {
  const by = beyond(ranges, value);
  if (by === null || by === 0 || !ranges.ideal) return by;
  const reach = reachOf(ranges.ideal, ranges.critical, by > 0);
  // Critical as soon as it is not ideal: there is nothing in between.
  if (!(reach > 0)) return Math.sign(by);
  return Math.max(-1, Math.min(1, by / reach));
}

function reachOf(ideal: Span, critical: Span | null, isAbove: boolean): number {
  if (!critical) return (ideal[1] - ideal[0]) / 2;
  return isAbove ? critical[1] - ideal[1] : ideal[0] - critical[0];
}

/** The ideal of each present species with its own ranges, and that of all others; empty: none has its own. */
export function idealsText(sensor: Sensor, tags: readonly Tag[]): string {
  const text = ({ ideal }: Ranges): string => rangeText(sensor, ideal);
  const own = [...new Set(tags.map(({ sureSpecies }) => sureSpecies.toLowerCase()))]
    .filter((species) => sensor.species.has(species))
    .sort()
    .map((species) => `${speciesText(species, 24)} ${text(rangesFor(sensor, species))}`);
  return own.length === 0 ? '' : [...own, `${S.legendOthers} ${text(sensor)}`].join('; ');
}

/** Blue, green, orange: distinct in hue and lightness for every common colour blindness. */
const FAR_LOW: Rgb = [20, 66, 170];
const LOW: Rgb = [96, 160, 238];
const RIGHT: Rgb = [158, 204, 168];
const HIGH: Rgb = [240, 158, 72];
const FAR_HIGH: Rgb = [176, 46, 10];
/** For a value without an ideal. */
const UNJUDGED: Rgb = [140, 140, 140];

/** Alpha of every known cell, so that none looks unknown. */
export const IDEAL_ALPHA = 0.72;

/** The colour of an excess; it changes abruptly at a limit, as the verdict does. */
export function idealColour(by: number | null): Rgb {
  if (by === null) return UNJUDGED;
  if (by === 0) return RIGHT;
  return by < 0 ? mix(LOW, FAR_LOW, -by) : mix(HIGH, FAR_HIGH, by);
}

export const idealParts = (alpha = 1): Readonly<Record<'low' | 'right' | 'high', string[]>> => ({
  low: [rgbText(FAR_LOW, alpha), rgbText(LOW, alpha)],
  right: [rgbText(RIGHT, alpha), rgbText(RIGHT, alpha)],
  high: [rgbText(HIGH, alpha), rgbText(FAR_HIGH, alpha)],
});

/** "ideal", "too low by 2.0 °C"; null: there is no ideal. */
export function idealText(sensor: Sensor, ranges: Ranges, value: number): string | null {
  const by = beyond(ranges, value);
  if (by === null) return null;
  if (by === 0) return S.idealParts.any;
  const text = differenceNumber(sensor, Math.abs(by));
  // An excess that rounds to 0 has no number.
  const how = /[1-9]/.test(text) ? withUnit(sensor, text) : null;
  return by < 0 ? S.tooLow(how) : S.tooHigh(how);
}

export interface Site {
  readonly at: MapPoint;
  readonly species: string;
}

export interface Zones {
  readonly kinds: readonly Ranges[];
  /** Index into `kinds` for each cell, row 0 at the bottom; null: all have the first. */
  readonly byCell: Uint8Array | null;
}

export type CellGrid = Pick<Field, 'width' | 'height' | 'originX' | 'originY' | 'resolution'>;

export function zonesOf(grid: CellGrid, sites: readonly Site[], sensor: Sensor): Zones {
  const kinds: Ranges[] = [];
  const bySite = sites.map(({ species }) => {
    const ranges = rangesFor(sensor, species);
    const known = kinds.indexOf(ranges);
    return known < 0 ? kinds.push(ranges) - 1 : known;
  });
  if (kinds.length <= 1) return { kinds: [kinds[0] ?? sensor], byCell: null };
  const nearest = nearestSites(grid, sites);
  return { kinds, byCell: Uint8Array.from(nearest, (site) => bySite[site] ?? 0) };
}

export const rangesAt = ({ kinds, byCell }: Zones, cell: number): Ranges | undefined =>
  kinds[byCell?.[cell] ?? 0];

/**
 * Index of the nearest site for each cell, passed on from cell to cell (Danielsson 1980): the cost
 * depends only on the cells. A cell about halfway between two sites may get either.
 */
function nearestSites(grid: CellGrid, sites: readonly { readonly at: MapPoint }[]): Int32Array {
  const { width, height, originX, originY, resolution } = grid;
  const nearest = new Int32Array(width * height).fill(-1);
  const squared = new Float64Array(width * height).fill(Infinity);
  const offer = (cell: number, x: number, y: number, site: number): void => {
    const at = sites[site]?.at;
    if (!at) return;
    const dx = originX + (x + 0.5) * resolution - at.x;
    const dy = originY + (y + 0.5) * resolution - at.y;
    const apart = dx * dx + dy * dy;
    if (apart >= (squared[cell] ?? 0)) return;
    squared[cell] = apart;
    nearest[cell] = site;
  };
  const clamped = (index: number, count: number): number => Math.max(0, Math.min(count - 1, index));
  sites.forEach(({ at }, site) => {
    const x = clamped(Math.floor((at.x - originX) / resolution), width);
    const y = clamped(Math.floor((at.y - originY) / resolution), height);
    offer(y * width + x, x, y, site);
  });
  const take = (x: number, y: number, dx: number, dy: number): void => {
    const fromX = x + dx;
    const fromY = y + dy;
    if (fromX < 0 || fromX >= width || fromY < 0 || fromY >= height) return;
    const site = nearest[fromY * width + fromX] ?? -1;
    if (site >= 0) offer(y * width + x, x, y, site);
  };
  // Up and down, and in each row forwards and backwards.
  for (const dy of [-1, 1]) {
    for (let row = 0; row < height; row++) {
      const y = dy < 0 ? row : height - 1 - row;
      for (let x = 0; x < width; x++) {
        for (const dx of [-1, 0, 1]) take(x, y, dx, dy);
        take(x, y, -1, 0);
      }
      for (let x = width - 1; x >= 0; x--) take(x, y, 1, 0);
    }
  }
  return nearest;
}

export const idealShade =
  (zones: Zones): Shade =>
  (value, cell) => {
    const ranges = rangesAt(zones, cell);
    return { rgb: idealColour(ranges ? excess(ranges, value) : null), alpha: IDEAL_ALPHA };
  };

export type ReadSite = ReturnType<typeof readSites>[number];

export function readSites(
  tags: readonly Tag[],
  said: Judgement['tags'],
  sensor: Pick<Sensor, 'name' | 'madeOf'>,
) {
  return tags.flatMap((tag) => {
    const { id, at, readings } = tag;
    const name = readingOf(sensor, readings);
    if (!at || readings.get(name) == null) return [];
    return [{ at, isOld: isOldReading(name, { tag, health: said[id] ?? NOT_JUDGED }) }];
  });
}

/** For each cell 1 if the nearest reading is too old, row 0 at the bottom; null: none is. */
export function oldCells(grid: CellGrid, sites: readonly ReadSite[]): Uint8Array | null {
  if (!sites.some(({ isOld }) => isOld)) return null;
  const nearest = nearestSites(grid, sites);
  return Uint8Array.from(nearest, (site) => Number(sites[site]?.isOld ?? false));
}

/** The field with only the cells for which `isIn` holds; all others are not known. */
export const cellsWhere = (field: Field, isIn: (cell: number) => boolean): Field => ({
  ...field,
  values: field.values.map((value, cell) => (isIn(cell) ? value : NaN)),
});

const FAINT = 0.22;

/** Colours cells that are too old faintly if they are hatched as well; otherwise leaves them bare. */
export const withOld =
  (shade: Shade, old: Uint8Array, isHatched: boolean): Shade =>
  (value, cell) => {
    const { rgb, alpha } = shade(value, cell);
    return { rgb, alpha: old[cell] === 0 ? alpha : isHatched ? alpha * FAINT : 0 };
  };
