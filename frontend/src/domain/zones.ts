/** Whose plants a cell of a field stands for: those of the nearest tag. Pure. */
import type { Field, Judgement } from '../contract/types';
import type { MapPoint } from '../geometry/coordinates';
import { excess, IDEAL_ALPHA, idealColour } from './ideal';
import type { Shade } from './ramp';
import { partsOf, type Ranges, rangesFor, type Sensor } from './sensors';
import type { Tag } from './twin';

export interface Site {
  readonly at: MapPoint;
  readonly species: string;
}

/** The ranges that hold in a house, and which of them holds in each cell. */
export interface Zones {
  /** Different ones, each once. */
  readonly kinds: readonly Ranges[];
  /** Index into `kinds`, cell by cell, row 0 at the bottom; null: all have the first. */
  readonly byCell: Uint8Array | null;
}

/** How a field lies in the map. */
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

/** The ranges that hold at a cell. */
export const rangesAt = ({ kinds, byCell }: Zones, cell: number): Ranges | undefined =>
  kinds[byCell?.[cell] ?? 0];

/**
 * Index of the nearest site for each cell, by handing on from cell to cell (Danielsson 1980): what it
 * costs depends on the cells alone. A cell as good as halfway between two may get either.
 */
export function nearestSites(
  grid: CellGrid,
  sites: readonly { readonly at: MapPoint }[],
): Int32Array {
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
  // Up and down, and in each row there and back.
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

/** Colours a field by how its values lie against the ranges of the plants that are nearest. */
export const idealShade =
  (zones: Zones): Shade =>
  (data, at, value, cell) => {
    const ranges = rangesAt(zones, cell);
    const [red, green, blue] = idealColour(ranges ? excess(ranges, value) : null);
    data[at] = red;
    data[at + 1] = green;
    data[at + 2] = blue;
    data[at + 3] = 255 * IDEAL_ALPHA;
  };

/** Where a field stands for a reading that the judge calls too old to say. Pure; judges nothing. */

/** A tag that a field has a reading from. */
export interface ReadSite {
  readonly at: MapPoint;
  readonly isOld: boolean;
}

/** The tags that a field of the sensor is made of. */
export function readSites(
  tags: readonly Tag[],
  said: Judgement['tags'],
  sensor: Pick<Sensor, 'name' | 'madeOf'>,
): ReadSite[] {
  return tags.flatMap(({ id, at, readings }) => {
    const parts = partsOf(sensor, (part) => readings.has(part));
    if (!at || parts.some((part) => (readings.get(part) ?? null) === null)) return [];
    const old = said[id]?.reasons.filter(({ kind }) => kind === 'old') ?? [];
    // Without a sensor's name it is said of all that the tag has. Of what is derived no age is
    // told, but where one part alone is old it is of another scan, and nothing is derived of it.
    const isOld = parts.every((part) => old.some(({ sensor }) => sensor === '' || sensor === part));
    return [{ at, isOld }];
  });
}

/** 1 where the nearest reading is too old, cell by cell, row 0 at the bottom; null: nowhere. */
export function oldCells(grid: CellGrid, sites: readonly ReadSite[]): Uint8Array | null {
  if (!sites.some(({ isOld }) => isOld)) return null;
  const nearest = nearestSites(grid, sites);
  return Uint8Array.from(nearest, (site) => Number(sites[site]?.isOld ?? false));
}

/** The cells of a field for which `isIn` holds; all others are not known. */
export const cellsWhere = (field: Field, isIn: (cell: number) => boolean): Field => ({
  ...field,
  values: field.values.map((value, cell) => (isIn(cell) ? value : NaN)),
});

/** What is left of a colour whose reading is too old. */
const FAINT = 0.22;

/** Colours what is too old faintly: it is hatched besides, and `isHatched` false leaves it bare. */
export const withOld =
  (shade: Shade, old: Uint8Array, isHatched: boolean): Shade =>
  (data, at, value, cell) => {
    if (old[cell] === 0) {
      shade(data, at, value, cell);
    } else if (isHatched) {
      shade(data, at, value, cell);
      data[at + 3] = (data[at + 3] ?? 0) * FAINT;
    }
  };
