/** A field minus that of another moment: yesterday against today. Pure. */
import type { Field, TagHealth } from '../contract/types';
import { S } from '../strings';
import { differenceNumber, intervalText, withUnit } from './format';
import { fraction, mix, type Range, rangeOf, type Rgb, rgbText, type Shade } from './ramp';
import type { Ranges, Sensor } from './sensors';
import type { Tag } from './twin';

/** How many days before the shown moment the other one is. */
export const COMPARED = { day: 1, week: 7 } as const;
export type Compare = keyof typeof COMPARED;

export const DAY_S = 86_400;

/**
 * The shown field minus the other, cell by cell, on one grid; a cell is known only if both are.
 * `valueMin` and `valueMax` cover the known cells; both are 0 without any. `then` is null if nothing
 * was recorded yet.
 */
export function differenceOf(shown: Field, then: Field | null): Field {
  const { sensor, width, height, originX, originY, resolution } = shown;
  const grid = { sensor, width, height, originX, originY, resolution };
  if (!then || then.sampleCount === 0) {
    const values = shown.values.map(() => NaN);
    return { ...grid, values, valueMin: 0, valueMax: 0, sampleCount: 0 };
  }
  for (const key of ['sensor', 'width', 'height', 'originX', 'originY', 'resolution'] as const) {
    if (shown[key] !== then[key]) {
      throw new Error(`difference: ${key} is ${shown[key]} and was ${then[key]}`);
    }
  }
  if (Boolean(shown.sureness) !== Boolean(then.sureness)) {
    throw new Error(then.noEstimate ?? shown.noEstimate ?? 'one of the two is no estimate');
  }
  const values = shown.values.map((value, index) => value - (then.values[index] ?? NaN));
  const known = rangeOf(values);
  return {
    ...grid,
    values,
    valueMin: known?.low ?? 0,
    valueMax: known?.high ?? 0,
    sampleCount: known ? Math.min(shown.sampleCount, then.sampleCount) : 0,
  };
}

/** A change below this share of the ideal range gets no full colour. */
const LEAST_OF_IDEAL = 0.05;

/** Symmetric around 0, or a small change one way would look like a large one the other way. */
export function symmetricRange({ valueMin, valueMax }: Field, { ideal }: Ranges): Range {
  const least = ideal ? LEAST_OF_IDEAL * (ideal[1] - ideal[0]) : 0;
  const most = Math.max(Math.abs(valueMin), Math.abs(valueMax), least);
  return { low: -most, high: most };
}

/** Less is blue and more is orange: distinguishable with every common colour blindness. */
const LESS: Rgb = [0, 92, 200];
const MORE: Rgb = [222, 92, 0];
/** No change is a visible grey: it differs from "not known". */
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

/** A difference with its sign, without its unit; no sign if it rounds to 0. */
export function signedText(sensor: Sensor, value: number): string {
  const text = differenceNumber(sensor, value);
  const isNothing = !/[1-9]/.test(text);
  if (isNothing) return text.replace('\u2212', '');
  return value > 0 ? `+${text}` : text;
}

/** The same with its unit: "+1.3 °C". */
export function differenceText(sensor: Sensor, value: number): string {
  return withUnit(sensor, signedText(sensor, value));
}

export interface TagThen {
  readonly tag: Tag;
  readonly health: TagHealth;
}

/**
 * Null: no valid reading now, so nothing to compare. `by`: now minus then, in the sensor's unit; none: no
 * valid reading then; same: it is still that reading.
 */
export function trendOf(sensor: string, now: TagThen, then: TagThen | null) {
  const value = held(sensor, now);
  if (value === null) return null;
  const before = then && held(sensor, then);
  if (then === null || before === null) return { kind: 'none' } as const;
  return changeOf(
    { value, observed_at: takenAt(sensor, now.tag) },
    { value: before, observed_at: takenAt(sensor, then.tag) },
  );
}

/** The length of a greenhouse's hour, seconds, if shorter than a real hour; else null. */
export const hourText = (seconds: number): string | null =>
  seconds < 3_600 ? intervalText(seconds) : null;

/** A valid reading; `observed_at` null: unknown, as of a derived value. */
export interface Taken {
  readonly value: number;
  readonly observed_at: number | null;
}

/** A reading compared with one before; same: it is still that reading. */
export function changeOf(now: Taken, then: Taken) {
  if (now.observed_at !== null && now.observed_at === then.observed_at)
    return { kind: 'same' } as const;
  return { kind: 'by', by: now.value - then.value } as const;
}

/** The value of a reading that is not too old; null: there is none. */
const held = (sensor: string, then: TagThen): number | null =>
  isOldReading(sensor, then) ? null : (then.tag.readings.get(sensor) ?? null);

/** Whether the bridge judges a reading too old; without a reading of this sensor, any of the tag's. */
export function isOldReading(sensor: string, { tag, health }: TagThen): boolean {
  const when = tag.readAt.get(sensor);
  return health.reasons.some(
    (reason) =>
      reason.kind === 'old' &&
      // Without a sensor's name the reason is about all of the tag; a derived value is as old as its scan.
      (when === undefined || reason.sensor === '' || tag.readAt.get(reason.sensor) === when),
  );
}

const takenAt = (sensor: string, { wire }: Tag): number | null =>
  wire.readings.find(({ name }) => name === sensor)?.observed_at ?? null;

/**
 * The difference to an hour before, as precise as the sensor's values: what rounds to 0 is level.
 * `text` has sign and unit, or says that there is no difference; `rate` says that it is per hour.
 */
export function differenceShown(
  sensor: Sensor,
  by: number,
): { readonly way: 'up' | 'down' | 'level'; readonly text: string; readonly rate: string } {
  const text = differenceText(sensor, by);
  const way = text.startsWith('+') ? 'up' : text.startsWith('\u2212') ? 'down' : 'level';
  if (way === 'level') return { way, text: S.trendLevel, rate: S.trendLevel };
  // A unit that has a time already, such as mol/m²/d, would be misread.
  return { way, text, rate: /[/·]/.test(sensor.unit) ? text : `${text}/${S.hours}` };
}
