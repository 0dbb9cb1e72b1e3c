/** How sure an estimate is of its cells, and how unsure nobody would call it known. Pure. */
import type { Field, Sureness } from '../contract/types';
import { fraction, rgbText, type Range, type Rgb, type Shade } from './ramp';

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
    const [red, green, blue] = ERROR;
    data[at] = red;
    data[at + 1] = green;
    data[at + 2] = blue;
    data[at + 3] = 255 * errorAlpha(fraction(range, value));
  };
