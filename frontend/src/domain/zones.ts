/** Whose plants a cell of a field stands for: those of the nearest tag. Pure. */
import type { Field } from '../contract/types';
import type { MapPoint } from '../geometry/coordinates';
import { excess, IDEAL_ALPHA, idealColour } from './ideal';
import type { Shade } from './ramp';
import { rangesFor, type Ranges, type Sensor } from './sensors';

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
