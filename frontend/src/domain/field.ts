import type { Estimate } from '../contract/api';
import type { Field, Sureness } from '../contract/types';
import { type Bounds, mapPoint, type MapPoint } from '../geometry/coordinates';
import type { MapPicture } from '../geometry/image';
import { fraction, type Range, rangeOf, type Rgb, rgbText, type Shade } from './ramp';

/** The cell that contains the point; null outside the grid. */
export function cellAt(field: Field, point: MapPoint): number | null {
  const column = Math.floor((point.x - field.originX) / field.resolution);
  const row = Math.floor((point.y - field.originY) / field.resolution);
  if (column < 0 || column >= field.width || row < 0 || row >= field.height) return null;
  return row * field.width + column;
}

/** The value of the cell that contains the point; null outside the grid or if not known. */
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

/** Colours a field. Not-a-number is transparent. The picture's top row is the grid's last row. */
export function fieldPixels({ width, height, values }: Field, shade: Shade) {
  const data = new Uint8ClampedArray(width * height * 4);
  values.forEach((value, cell) => {
    if (Number.isNaN(value)) return;
    const { rgb, alpha } = shade(value, cell);
    const at = ((height - 1 - Math.floor(cell / width)) * width + (cell % width)) * 4;
    [data[at], data[at + 1], data[at + 2]] = rgb;
    data[at + 3] = 255 * alpha;
  });
  return { width, height, data };
}

export function fieldCorners(field: Field): readonly [MapPoint, MapPoint] {
  const { originX, originY, width, height, resolution } = field;
  return [
    mapPoint(originX, originY),
    mapPoint(originX + width * resolution, originY + height * resolution),
  ];
}

/** Each cell is drawn as this many by this many; odd, so that one of them has the cell's own value. */
const FINER = 3;
/** Weights of the cell before, the cell itself and the one after, for each part of the cell. */
type Weights = readonly (readonly [number, number, number])[];
const LINEAR: Weights = [
  [1 / 3, 2 / 3, 0],
  [0, 1, 0],
  [0, 2 / 3, 1 / 3],
];
const BLUR: Weights = [[1 / 4, 1 / 2, 1 / 4]];

/** Weighted sums along both axes. Beyond the grid its outermost cells go on. */
function summed(cells: Float32Array, width: number, height: number, weights: Weights) {
  const along = (rows: Float32Array, length: number): Float32Array => {
    const columns = new Float32Array(rows.length * weights.length);
    const count = rows.length / length;
    weights.forEach(([before, own, after], part) => {
      for (let cell = 0; cell < rows.length; cell++) {
        const x = cell % length;
        columns[(x * weights.length + part) * count + (cell - x) / length] =
          before * (rows[x > 0 ? cell - 1 : cell] ?? 0) +
          own * (rows[cell] ?? 0) +
          after * (rows[x < length - 1 ? cell + 1 : cell] ?? 0);
      }
    });
    return columns;
  };
  return along(along(cells, width), height);
}

function refined(values: Float32Array, width: number, height: number): Float32Array {
  const known = values.map((value) => Number(!Number.isNaN(value)));
  const blurred = summed(summed(known, width, height, BLUR), width, height, BLUR);
  // The centre of a cell stays what it is.
  const inside = blurred.map((share, cell) =>
    known[cell] ? Math.max(0.5, share) : Math.min(0.49, share),
  );
  const share = summed(inside, width, height, LINEAR);
  const weight = summed(known, width, height, LINEAR);
  const numbers = values.map((value) => (Number.isNaN(value) ? 0 : value));
  const sum = summed(numbers, width, height, LINEAR);
  return sum.map((value, cell) => ((share[cell] ?? 0) < 0.5 ? NaN : value / (weight[cell] ?? 1)));
}

/**
 * The field in finer cells, so that its own do not show as steps: values are interpolated between known
 * cells, and the edge of what is known is rounded. The centre of an unknown cell stays unknown.
 */
export function finer(field: Field): Field {
  const { width, height, sureness } = field;
  return {
    ...field,
    width: width * FINER,
    height: height * FINER,
    resolution: field.resolution / FINER,
    values: refined(field.values, width, height),
    ...(sureness && { sureness: { ...sureness, sd: refined(sureness.sd, width, height) } }),
  };
}

/** Middles of the sides of a square between the centres of four cells, from the first centre. */
const SIDES = [
  [0.5, 0],
  [1, 0.5],
  [0.5, 1],
  [0, 0.5],
] as const;

/**
 * Outline of the known area: lines as successive x0, y0, x1, y1, metres in the map frame. It cuts the
 * corners of cells (marching squares).
 */
export function edgesOf({ width, height, originX, originY, resolution, values }: Field): number[] {
  const isKnown = (x: number, y: number): boolean =>
    x >= 0 && x < width && y >= 0 && y < height && !Number.isNaN(values[y * width + x]);
  const lines: number[] = [];
  for (let y = -1; y < height; y++) {
    for (let x = -1; x < width; x++) {
      const first = isKnown(x, y);
      const [second, third, fourth] = [isKnown(x + 1, y), isKnown(x + 1, y + 1), isKnown(x, y + 1)];
      if (first === second && second === third && third === fourth) continue;
      const corners = [first, second, third, fourth];
      SIDES.forEach(([right, up], side) => {
        if (corners[side] === corners[(side + 1) % 4]) return;
        lines.push(originX + (x + 0.5 + right) * resolution, originY + (y + 0.5 + up) * resolution);
      });
    }
  }
  return lines;
}

/** Nine of ten values of a normal distribution lie within this many standard deviations. */
export const NINE_OF_TEN = 1.645;

/**
 * Errors at which the hatching becomes denser, as ratios to the limit of a known cell. From the last
 * on, a cell is not known: hardly surer than without any tag nearby.
 */
export const STEPS = [1, 7 / 6, 8 / 6, 9 / 6] as const;
export const NOT_KNOWN_STEP = STEPS.length;

/** 0: known; then the number of steps that the error reaches. At the last step nothing is known. */
export function stepOf(sd: number, sdKnown: number): number {
  if (Number.isNaN(sd)) return NOT_KNOWN_STEP;
  return STEPS.filter((step) => !(sd < step * sdKnown)).length;
}

export const stepsIn = ({ sd, sdKnown }: Sureness): Uint8Array =>
  Uint8Array.from(sd, (each) => stepOf(each, sdKnown));

/** Half the width of the range that nine of ten values fall into, from a standard deviation. */
export const plusMinus = (sd: number): number => NINE_OF_TEN * sd;

/** The error alone, as a field of plus-or-minus values, also where the value is not known. */
export function errorField(field: Field, { sd }: Sureness): Field {
  const values = sd.map(plusMinus);
  const finite = values.filter((value) => !Number.isNaN(value));
  return {
    ...field,
    values,
    valueMin: 0,
    valueMax: finite.reduce((most, value) => Math.max(most, value), 0),
  };
}

/** A colour that no sensor and no verdict has. */
const ERROR: Rgb = [112, 58, 168];
const FAINTEST = 0.08;
const STRONGEST = 0.82;

const errorAlpha = (share: number): number => FAINTEST + (STRONGEST - FAINTEST) * share;

export const errorColours = (): string[] =>
  [0, 1].map((share) => rgbText(ERROR, errorAlpha(share)));

export const errorShade =
  (range: Range): Shade =>
  (value) => ({ rgb: ERROR, alpha: errorAlpha(fraction(range, value)) });

/** The field of a received estimate: cells that are too unsure are not known. Pure. */
export function estimatedField(sensor: string, estimate: Estimate): Field {
  const { mean, sd, sdKnown, ...grid } = estimate;
  const values = mean.map((value, cell) =>
    stepOf(sd[cell] ?? NaN, sdKnown) < NOT_KNOWN_STEP ? value : NaN,
  );
  const known = rangeOf(values);
  return {
    ...grid,
    sensor,
    valueMin: known?.low ?? 0,
    valueMax: known?.high ?? 0,
    values,
    sureness: { sd, sdKnown },
  };
}

/** Outside the greenhouse nothing is coloured: neither an estimate nor the past is clipped to the map. */
export function onExplored(
  field: Field,
  { placement, pixels }: Pick<MapPicture, 'placement' | 'pixels'>,
): Field {
  const { sureness, width, originX, originY, resolution } = field;
  const cos = Math.cos(placement.yaw);
  const sin = Math.sin(placement.yaw);
  const isExplored = (cell: number): boolean => {
    const x = originX + ((cell % width) + 0.5) * resolution - placement.originX;
    const y = originY + (Math.floor(cell / width) + 0.5) * resolution - placement.originY;
    const column = Math.floor((cos * x + sin * y) / placement.resolution);
    const row = Math.floor((cos * y - sin * x) / placement.resolution);
    if (column < 0 || column >= pixels.width || row < 0 || row >= pixels.height) return false;
    const pixel = (pixels.height - 1 - row) * pixels.width + column;
    return (pixels.data[pixel * 4 + 3] ?? 0) > 0;
  };
  const values = field.values.slice();
  const sd = sureness?.sd.slice();
  for (let cell = 0; cell < values.length; cell++) {
    if (isExplored(cell)) continue;
    values[cell] = NaN;
    if (sd) sd[cell] = NaN;
  }
  return sureness && sd
    ? { ...field, values, sureness: { ...sureness, sd } }
    : { ...field, values };
}
