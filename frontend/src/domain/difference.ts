/** A field less another of the same house at another moment: yesterday against today. Pure. */
import type { Field, TagHealth } from '../contract/types';
import { S } from '../strings';
import { differenceNumber, type TemperatureUnit, withUnit } from './format';
import { fraction, mix, type Range, rangeOf, type Rgb, rgbText, type Shade } from './ramp';
import type { Ranges, Sensor } from './sensors';
import type { Tag } from './twin';

/** What the moment that is shown is compared with: so many seconds before it, or one moment. */
export type Compare =
  { readonly by: 'ago'; readonly seconds: number } | { readonly by: 'moment'; readonly at: number };

export const DAY_S = 86_400;
export const WEEK_S = 7 * DAY_S;

/** ROS seconds. */
export const otherMoment = (compare: Compare, shownAt: number): number =>
  compare.by === 'moment' ? compare.at : shownAt - compare.seconds;

/**
 * What is shown less what was then, cell by cell, on their one grid; not known where either is
 * not. `valueMin` and `valueMax` range over what is known; both are 0 where nothing is.
 */
export function differenceOf(shown: Field, then: Field): Field {
  for (const key of ['sensor', 'width', 'height', 'originX', 'originY', 'resolution'] as const) {
    if (shown[key] !== then[key]) {
      throw new Error(`difference: ${key} is ${shown[key]} and was ${then[key]}`);
    }
  }
  if (Boolean(shown.sureness) !== Boolean(then.sureness)) {
    throw new Error('difference: one of the two is no estimate');
  }
  const values = shown.values.map((value, index) => value - (then.values[index] ?? NaN));
  const known = rangeOf(values);
  const { sensor, width, height, originX, originY, resolution } = shown;
  return {
    ...{ sensor, width, height, originX, originY, resolution },
    values,
    valueMin: known?.low ?? 0,
    valueMax: known?.high ?? 0,
    sampleCount: known ? Math.min(shown.sampleCount, then.sampleCount) : 0,
  };
}

/** Less than this share of the ideal range is no change worth a full colour. */
const LEAST_OF_IDEAL = 0.05;

/** As far below 0 as above it, or a small change would look like a large one of the other kind. */
export function symmetricRange({ valueMin, valueMax }: Field, { ideal }: Ranges): Range {
  const least = ideal ? LEAST_OF_IDEAL * (ideal[1] - ideal[0]) : 0;
  const most = Math.max(Math.abs(valueMin), Math.abs(valueMax), least);
  return { low: -most, high: most };
}

/** Less is blue and more is orange, which no common colour blindness takes for each other. */
const LESS: Rgb = [0, 92, 200];
const MORE: Rgb = [222, 92, 0];
/** No change is grey and to be seen: it is not the same as not known. */
const SAME: Rgb = [128, 128, 128];
const FAINTEST = 0.2;
const STRONGEST = 0.8;

export const divergingShade =
  (range: Range): Shade =>
  (value) => {
    const signed = range.high > 0 ? 2 * fraction(range, value) - 1 : 0;
    const size = Math.abs(signed);
    return {
      rgb: mix(SAME, signed < 0 ? LESS : MORE, Math.sqrt(size)),
      alpha: FAINTEST + (STRONGEST - FAINTEST) * size,
    };
  };

const STOPS = [-1, -0.75, -0.5, -0.25, 0, 0.25, 0.5, 0.75, 1];

export const divergingColours = (): string[] =>
  STOPS.map((stop) => {
    const { rgb, alpha } = divergingShade({ low: -1, high: 1 })(stop, 0);
    return rgbText(rgb, alpha);
  });

/** A difference with its sign, without its unit; no sign where nothing is left to show. */
export function signedText(sensor: Sensor, value: number, unit: TemperatureUnit): string {
  const text = differenceNumber(sensor, value, unit);
  const isNothing = !/[1-9]/.test(text);
  if (isNothing) return text.replace('\u2212', '');
  return value > 0 ? `+${text}` : text;
}

/** The same with its unit: "+1.3 °C". */
export function differenceText(sensor: Sensor, value: number, unit: TemperatureUnit): string {
  return withUnit(sensor, signedText(sensor, value, unit), unit);
}

export interface TagThen {
  readonly tag: Tag;
  readonly health: TagHealth;
}

/**
 * Null: there is no reading now that holds, and nothing to compare. `by`: what is now less what was then, in
 * the sensor's unit; none: there was no reading, or none that held then; same: it is the reading of then.
 */
export function trendOf(sensor: string, now: TagThen, then: TagThen | null) {
  const value = held(sensor, now);
  if (value === null) return null;
  const before = then && held(sensor, then);
  if (then === null || before === null) return { kind: 'none' } as const;
  if (sameReading(sensor, now.tag, then.tag)) return { kind: 'same' } as const;
  return { kind: 'by', by: value - before } as const;
}

/** The value of a reading that has not grown too old; null: there is none. */
const held = (sensor: string, then: TagThen): number | null =>
  isOldReading(sensor, then) ? null : (then.tag.readings.get(sensor) ?? null);

/** Whether a reading has grown too old, as the bridge judges age; of what is derived, any other. */
export function isOldReading(sensor: string, { tag, health }: TagThen): boolean {
  const isDerived = !tag.readings.has(sensor);
  return health.reasons.some(
    (reason) =>
      reason.kind === 'old' && (isDerived || reason.sensor === '' || reason.sensor === sensor),
  );
}

export function sameReading(sensor: string, a: Tag, b: Tag): boolean {
  const at = ({ wire }: Tag): string =>
    JSON.stringify(wire.readings.find(({ name }) => name === sensor)?.observed_at ?? null);
  return at(a) !== 'null' && at(a) === at(b);
}

/**
 * The difference as precise as the sensor's values are: what rounds to nothing is level. `text` has its
 * sign and its unit, or says that there is none.
 */
export function differenceShown(
  sensor: Sensor,
  by: number,
  unit: TemperatureUnit,
): { readonly way: 'up' | 'down' | 'level'; readonly text: string } {
  const text = differenceText(sensor, by, unit);
  const way = text.startsWith('+') ? 'up' : text.startsWith('\u2212') ? 'down' : 'level';
  return { way, text: way === 'level' ? S.trendLevel : text };
}
