/** A wall screen's round through the sensors: how it is asked for, and what comes next. */
import type { Sensor } from './sensors';
import type { Tag } from './twin';

/** Seconds that one sensor may be shown. */
export const CYCLE_LIMITS = { least: 5, most: 3_600 } as const;

export interface CycleWish {
  /** Seconds a sensor; null: the sensor stays. */
  readonly seconds: number | null;
  /** What was asked for and cannot be had, as it was written; null: nothing. */
  readonly refused: string | null;
}

/** The wish in an address: `?kiosk=1&cycle=30`. A bad one is told and counts as none. */
export function cycleWish(search: string): CycleWish {
  const text = new URLSearchParams(search).get('cycle');
  if (text === null) return { seconds: null, refused: null };
  const seconds = /^\d{1,4}$/.test(text) ? Number(text) : NaN;
  return seconds >= CYCLE_LIMITS.least && seconds <= CYCLE_LIMITS.most
    ? { seconds, refused: null }
    : { seconds: null, refused: text };
}

/** The sensors that some tag has. */
export const sensorsOf = (tags: readonly Tag[], offered: readonly Sensor[]): readonly Sensor[] =>
  offered.filter(({ name }) => tags.some((tag) => tag.readings.has(name)));

/** The one after `current`, the first after the last; null: there is no other. */
export function sensorAfter(sensors: readonly Sensor[], current: string): Sensor | null {
  const index = sensors.findIndex(({ name }) => name === current);
  const next = sensors[(index + 1) % Math.max(1, sensors.length)];
  return next && next.name !== current ? next : null;
}

/** The address of the same page to be operated: without what makes it a wall screen. */
export function addressOfPage(search: string, hash: string): string {
  const parts = new URLSearchParams(search);
  parts.delete('kiosk');
  parts.delete('cycle');
  const rest = parts.toString();
  return `?${rest}${hash}`;
}
