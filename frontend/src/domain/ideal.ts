/** How a value lies against its ideal range: too low, right, too high; in colour and in words. Pure. */
import { S } from '../strings';
import { differenceNumber, rangeText, withUnit } from './format';
import { mix, rgbText, type Rgb } from './ramp';
import { rangesFor, type Ranges, type Sensor, type Span } from './sensors';
import { speciesText } from './species';
import type { Tag } from './twin';
import type { TemperatureUnit } from './units';

/** How far beyond its ideal range a value is, in its unit: below 0 too low, 0 right; null: no ideal. */
export function beyond({ ideal }: Ranges, value: number): number | null {
  if (!ideal) return null;
  const [low, high] = ideal;
  return value < low ? value - low : value > high ? value - high : 0;
}

/**
 * The same from -1 to 1, where the critical limit is reached; without one, at half the ideal
 * range's width beyond it.
 */
export function excess(ranges: Ranges, value: number): number | null {
  const by = beyond(ranges, value);
  if (by === null || by === 0 || !ranges.ideal) return by;
  const reach = reachOf(ranges.ideal, ranges.critical, by > 0);
  // Critical where it is no more ideal: there is no way between.
  if (!(reach > 0)) return Math.sign(by);
  return Math.max(-1, Math.min(1, by / reach));
}

function reachOf(ideal: Span, critical: Span | null, isAbove: boolean): number {
  if (!critical) return (ideal[1] - ideal[0]) / 2;
  return isAbove ? critical[1] - ideal[1] : ideal[0] - critical[0];
}

/** The ideal of each species that is there with one of its own, and of all others; empty: no species has. */
export function idealsText(sensor: Sensor, tags: readonly Tag[], unit: TemperatureUnit): string {
  const text = ({ ideal }: Ranges): string =>
    rangeText(sensor, ideal && { low: ideal[0], high: ideal[1] }, unit);
  const own = [...new Set(tags.map(({ sureSpecies }) => sureSpecies.toLowerCase()))]
    .filter((species) => sensor.species.has(species))
    .sort()
    .map((species) => `${speciesText(species, 24)} ${text(rangesFor(sensor, species))}`);
  return own.length === 0 ? '' : [...own, `${S.legendOthers} ${text(sensor)}`].join('; ');
}

/** Blue, green, orange: apart in hue and lightness for every common colour blindness. */
const FAR_LOW: Rgb = [20, 66, 170];
const LOW: Rgb = [96, 160, 238];
const RIGHT: Rgb = [158, 204, 168];
const HIGH: Rgb = [240, 158, 72];
const FAR_HIGH: Rgb = [176, 46, 10];
/** Of what nobody has an ideal of. */
const UNJUDGED: Rgb = [140, 140, 140];

/** Everywhere that is known is painted so: no value looks like one that is not known. */
export const IDEAL_ALPHA = 0.72;

/** The colour of an excess; just past a limit it is another one at once, as the verdict is. */
export function idealColour(by: number | null): Rgb {
  if (by === null) return UNJUDGED;
  if (by === 0) return RIGHT;
  return by < 0 ? mix(LOW, FAR_LOW, -by) : mix(HIGH, FAR_HIGH, by);
}

/** The colours of the three parts, each from left to right. */
export const idealParts = (alpha = 1): Readonly<Record<'low' | 'right' | 'high', string[]>> => ({
  low: [rgbText(FAR_LOW, alpha), rgbText(LOW, alpha)],
  right: [rgbText(RIGHT, alpha), rgbText(RIGHT, alpha)],
  high: [rgbText(HIGH, alpha), rgbText(FAR_HIGH, alpha)],
});

/** "ideal", "too low by 2.0 °C"; null: there is no ideal. */
export function idealText(
  sensor: Sensor,
  ranges: Ranges,
  value: number,
  unit: TemperatureUnit,
): string | null {
  const by = beyond(ranges, value);
  if (by === null) return null;
  if (by === 0) return S.idealParts.any;
  const text = differenceNumber(sensor, Math.abs(by), unit);
  // Of less than can be told there is nothing to tell.
  const how = /[1-9]/.test(text) ? withUnit(sensor, text, unit) : null;
  return by < 0 ? S.tooLow(how) : S.tooHigh(how);
}
