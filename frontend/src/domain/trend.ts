/** A reading against the same an hour before, as far as the bridge lets either stand. Pure. */
import type { TagHealth } from '../contract/types';
import { differenceText } from './difference';
import type { Sensor } from './sensors';
import { S } from '../strings';
import type { Tag } from './twin';
import type { TemperatureUnit } from './units';

/** A tag, and what the bridge said of it at that moment. */
export interface TagThen {
  readonly tag: Tag;
  readonly health: TagHealth;
}

export type Trend =
  /** `by`: what is now less what was then, in the sensor's unit. */
  | { readonly kind: 'by'; readonly by: number }
  /** No reading of then, or none that held then. */
  | { readonly kind: 'none' }
  /** The reading of now is that of then. */
  | { readonly kind: 'same' };

/** Null: there is no reading now that holds, and nothing to compare. */
export function trendOf(sensor: string, now: TagThen, then: TagThen | null): Trend | null {
  const value = held(sensor, now);
  if (value === null) return null;
  const before = then && held(sensor, then);
  if (then === null || before === null) return { kind: 'none' };
  if (sameReading(sensor, now.tag, then.tag)) return { kind: 'same' };
  return { kind: 'by', by: value - before };
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

/** Whether both have the very same reading of a sensor. */
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
