/** How sure an estimate is of its cells, and how unsure nobody would call it known. Pure. */
import type { Estimate } from '../contract/api';
import type { Field, Sureness } from '../contract/types';
import type { Placement } from '../geometry/image';
import { fraction, paint, type Range, rangeOf, type Rgb, rgbText, type Shade } from './ramp';

/** Nine of ten values of a normal distribution lie within so many standard deviations. */
export const NINE_OF_TEN = 1.645;

/**
 * Errors as ratios to that below which a cell is known, at which the hatching becomes denser. From the
 * last on a cell is not known: hardly surer than if no tag were anywhere near.
 */
export const STEPS = [1, 7 / 6, 8 / 6, 9 / 6] as const;
export const NOT_KNOWN_STEP = STEPS.length;

/** 0: known; then one for each step that the error reaches, the last: not known at all. */
export function stepOf(sd: number, sdKnown: number): number {
  if (Number.isNaN(sd)) return NOT_KNOWN_STEP;
  return STEPS.filter((step) => !(sd < step * sdKnown)).length;
}

/** The steps cell by cell, row 0 at the bottom. */
export const stepsIn = ({ sd, sdKnown }: Sureness): Uint8Array =>
  Uint8Array.from(sd, (each) => stepOf(each, sdKnown));

/** Half the width of the range that nine of ten values fall into, from a standard deviation. */
export const plusMinus = (sd: number): number => NINE_OF_TEN * sd;

/** The error alone, as a field: plus or minus what, also where it is too large to be known. */
export function errorField(field: Field, { sd }: Sureness): Field {
  const values = sd.map(plusMinus);
  const told = values.filter((value) => !Number.isNaN(value));
  return {
    ...field,
    values,
    valueMin: 0,
    valueMax: told.reduce((most, value) => Math.max(most, value), 0),
  };
}

/** Of no sensor and of no verdict. */
const ERROR: Rgb = [112, 58, 168];
const FAINTEST = 0.08;
const STRONGEST = 0.82;

const errorAlpha = (share: number): number => FAINTEST + (STRONGEST - FAINTEST) * share;

/** The colours of the error, from none to the most. */
export const errorColours = (): string[] =>
  [0, 1].map((share) => rgbText(ERROR, errorAlpha(share)));

/** The more colour, the less sure. */
export const errorShade =
  (range: Range): Shade =>
  (data, at, value) => {
    paint(data, at, ERROR, errorAlpha(fraction(range, value)));
  };

/** A field of an estimate as it came: what is too unsure is not known. Pure. */
export function estimatedField(sensor: string, estimate: Estimate): Field {
  const { mean, sd, sdKnown, readingCount, ...grid } = estimate;
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
    sureness: { sd, sdKnown, readingCount },
  };
}

/** What of an estimate lies on explored ground, as the twin clips the nearest readings. Pure. */

/** A map's picture: RGBA, top row first; transparent is not explored. */
interface Explored {
  readonly placement: Placement;
  readonly pixels: Pick<ImageData, 'data' | 'width' | 'height'>;
}

/** An estimate tells a number for every cell, outside the house too; there it is not asked. */
export function onExplored(field: Field, { placement, pixels }: Explored): Field {
  const { sureness, width, originX, originY, resolution } = field;
  if (!sureness) return field;
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
  const sd = sureness.sd.slice();
  for (let cell = 0; cell < values.length; cell++) {
    if (isExplored(cell)) continue;
    values[cell] = NaN;
    sd[cell] = NaN;
  }
  return { ...field, values, sureness: { ...sureness, sd } };
}
