/** If set, a wall screen changes to the next sensor every few seconds. */
import { isMeasured, type Sensor } from '../domain/sensors';
import type { Tag } from '../domain/twin';
import { act, store } from './app';
import { selectSensors } from './derived';
import { selectTags } from './moment';

export const CYCLE_LIMITS = { least: 5, most: 3_600 } as const;

export type CycleSetting = ReturnType<typeof cycleSetting>;

/** The setting in an address: `?kiosk=1&cycle=30`. `seconds` per sensor; null: it stays. An invalid one is `refused`. */
export function cycleSetting(search: string) {
  const text = new URLSearchParams(search).get('cycle');
  const seconds = text !== null && /^\d{1,4}$/.test(text) ? Number(text) : NaN;
  const isAllowed = seconds >= CYCLE_LIMITS.least && seconds <= CYCLE_LIMITS.most;
  return { seconds: isAllowed ? seconds : null, refused: isAllowed ? null : text };
}

export const sensorsOf = (tags: readonly Tag[], offered: readonly Sensor[]): readonly Sensor[] =>
  offered.filter((each) => isMeasured(each) && tags.some((tag) => tag.readings.has(each.name)));

/** The sensor after `current`, the first after the last; null: there is no other. */
function sensorAfter(sensors: readonly Sensor[], current: string): Sensor | null {
  const index = sensors.findIndex(({ name }) => name === current);
  const next = sensors[(index + 1) % Math.max(1, sensors.length)];
  return next && next.name !== current ? next : null;
}

/** The address of the same page with controls: without the wall screen's parameters. */
export function addressOfPage(search: string, hash: string): string {
  const parts = new URLSearchParams(search);
  parts.delete('kiosk');
  parts.delete('cycle');
  const rest = parts.toString();
  return `?${rest}${hash}`;
}

export function startCycle({ seconds }: CycleSetting): () => void {
  if (seconds === null) return () => undefined;
  const timer = setInterval(() => {
    const state = store.get();
    // Nothing changes below somebody who looks back.
    if (state.view.moment !== null) return;
    const sensors = sensorsOf(selectTags(state), selectSensors(state));
    const next = sensorAfter(sensors, state.view.sensor);
    if (next) act({ sensor: next.name });
  }, seconds * 1000);
  return () => clearInterval(timer);
}
