/** If set, a wall screen changes to the next sensor every few seconds. */
import { isMeasured, type Sensor } from '../domain/sensors';
import type { Tag } from '../domain/twin';
import { act, store } from './app';
import { PAGE } from './create';
import { selectSensors } from './derived';
import { selectTags } from './moment';

/** Seconds per sensor in an address, `?kiosk=1&cycle=30`, from 5 to 3,600; null: the sensor stays. */
export function cycleSeconds(search: string): number | null {
  const seconds = parseInt(new URLSearchParams(search).get('cycle') ?? '', 10);
  return Number.isNaN(seconds) ? null : Math.min(3_600, Math.max(5, seconds));
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

export function startCycle(seconds: number | null, signal = PAGE): void {
  if (seconds === null) return;
  const timer = setInterval(() => {
    const state = store.get();
    // Nothing changes below somebody who looks back.
    if (state.view.moment !== null) return;
    const sensors = sensorsOf(selectTags(state), selectSensors(state));
    const next = sensorAfter(sensors, state.view.sensor);
    if (next) act({ sensor: next.name });
  }, seconds * 1000);
  signal.addEventListener('abort', () => clearInterval(timer));
}
