import type { Field } from '../contract/types';
import { type Bounds, mapPoint, type MapPoint } from '../geometry/coordinates';
import type { Shade } from './ramp';

/** The cell that holds the point; null outside the grid. */
export function cellAt(field: Field, point: MapPoint): number | null {
  const column = Math.floor((point.x - field.originX) / field.resolution);
  const row = Math.floor((point.y - field.originY) / field.resolution);
  if (column < 0 || column >= field.width || row < 0 || row >= field.height) return null;
  return row * field.width + column;
}

/** The value of the cell that holds the point; null outside the grid and where it is not known. */
export function valueAt(field: Field, point: MapPoint): number | null {
  const cell = cellAt(field, point);
  const value = cell === null ? undefined : field.values[cell];
  return value === undefined || Number.isNaN(value) ? null : value;
}

/** The finest round cell size, in metres, that keeps a box under `maxCells` cells. */
export function resolutionFor(bounds: Bounds, maxCells: number): number {
  const area = (bounds.maxX - bounds.minX) * (bounds.maxY - bounds.minY);
  const finest = Math.sqrt(Math.max(0, area) / maxCells);
  for (const step of [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50]) {
    if (step >= finest) return step;
  }
  return finest;
}

interface Pixels {
  readonly width: number;
  readonly height: number;
  /** RGBA, top row first. */
  readonly data: Uint8ClampedArray<ArrayBuffer>;
}

/**
 * Colours a field. Not-a-number is fully transparent. The picture's top row is the grid's last
 * row. With `detail` above 1 every cell becomes detail x detail pixels whose values are
 * interpolated between cell centres, in values and not in colours: a picture scaled by the
 * browser would let colour bleed into cells that are not known.
 */
export function fieldPixels(field: Field, shade: Shade, detail: number): Pixels {
  const width = field.width * detail;
  const height = field.height * detail;
  const data = new Uint8ClampedArray(width * height * 4);
  let at = 0;
  for (let top = 0; top < height; top++) {
    const y = height - 1 - top;
    const row = Math.floor(y / detail) * field.width;
    for (let x = 0; x < width; x++, at += 4) {
      const value =
        detail === 1
          ? (field.values[y * field.width + x] ?? NaN)
          : interpolate(field, (x + 0.5) / detail - 0.5, (y + 0.5) / detail - 0.5);
      if (Number.isNaN(value)) continue;
      shade(data, at, value, row + Math.floor(x / detail));
    }
  }
  return { width, height, data };
}

/**
 * Value between cell centres, `u` and `v` in cells with the first centre at 0. Not-a-number
 * where the cell that holds the point is; unknown neighbours have no say.
 */
export function interpolate(field: Field, u: number, v: number): number {
  const { width, height, values } = field;
  const own = values[Math.round(v) * width + Math.round(u)] ?? NaN;
  if (Number.isNaN(own)) return NaN;
  const column = Math.floor(u);
  const row = Math.floor(v);
  let sum = 0;
  let weights = 0;
  for (let dr = 0; dr < 2; dr++) {
    const r = row + dr;
    if (r < 0 || r >= height) continue;
    for (let dc = 0; dc < 2; dc++) {
      const c = column + dc;
      if (c < 0 || c >= width) continue;
      const value = values[r * width + c] ?? NaN;
      if (Number.isNaN(value)) continue;
      const weight = (1 - Math.abs(u - c)) * (1 - Math.abs(v - r));
      sum += weight * value;
      weights += weight;
    }
  }
  return weights > 0 ? sum / weights : own;
}

/** Pixels a cell edge for a smooth picture, so that it stays under two million pixels. */
export function smoothDetail(field: Field): number {
  const cells = Math.max(1, field.width * field.height);
  return Math.max(1, Math.min(8, Math.floor(Math.sqrt(2_000_000 / cells))));
}

/** Lower left and upper right corner of the grid. */
export function fieldCorners(field: Field): readonly [MapPoint, MapPoint] {
  const { originX, originY, width, height, resolution } = field;
  return [
    mapPoint(originX, originY),
    mapPoint(originX + width * resolution, originY + height * resolution),
  ];
}

/** Where the known ends: straight lines as x0, y0, x1, y1, metres in the map frame, one after the other. */
export function edgesOf({ width, height, originX, originY, resolution, values }: Field): number[] {
  const isKnown = (x: number, y: number): boolean =>
    x >= 0 && x < width && y >= 0 && y < height && !Number.isNaN(values[y * width + x]);
  const lines: number[] = [];
  // Runs of cell sides on one straight line are one line.
  const runs = (
    count: number,
    isEdge: (index: number) => boolean,
    corner: (index: number) => readonly [x: number, y: number],
  ): void => {
    let from = -1;
    for (let index = 0; index <= count; index++) {
      const is = index < count && isEdge(index);
      if (is && from < 0) from = index;
      if (is || from < 0) continue;
      for (const [x, y] of [corner(from), corner(index)]) {
        lines.push(originX + x * resolution, originY + y * resolution);
      }
      from = -1;
    }
  };
  for (let y = 0; y <= height; y++) {
    runs(
      width,
      (x) => isKnown(x, y - 1) !== isKnown(x, y),
      (x) => [x, y],
    );
  }
  for (let x = 0; x <= width; x++) {
    runs(
      height,
      (y) => isKnown(x - 1, y) !== isKnown(x, y),
      (y) => [x, y],
    );
  }
  return lines;
}
