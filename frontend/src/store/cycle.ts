/** If set, a wall screen changes to the next sensor every few seconds. */
import { now } from '../clock';
import { isMeasured, type Sensor } from '../domain/sensors';
import type { Tag } from '../domain/twin';
import { act, store } from './app';
import { createStore } from './create';
import { selectSensors } from './derived';
import { memoLast } from '../domain/memo';
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

/** The next sensor, and when, ms on the page's clock; null: the sensor in view stays. */
export const nextSensor = createStore<{ readonly sensor: Sensor; readonly at: number } | null>(
  null,
);

const round = memoLast(sensorsOf);

export function startCycle({ seconds }: CycleSetting): () => void {
  if (seconds === null) return () => undefined;
  let timer: ReturnType<typeof setTimeout> | undefined;
  let shown: string | null = null;

  const update = (): void => {
    const state = store.get();
    const { view } = state;
    const sensors = round(selectTags(state), selectSensors(state));
    // A past moment does not cycle.
    const sensor = view.moment === null ? sensorAfter(sensors, view.sensor) : null;
    const before = nextSensor.get();
    if (sensor === null) {
      clearTimeout(timer);
      shown = null;
      nextSensor.set(null);
      return;
    }
    // A sensor chosen by hand stays for the full time.
    const isSame = before !== null && shown === view.sensor;
    const at = isSame ? before.at : now() + seconds * 1000;
    if (isSame && before.sensor === sensor) return;
    shown = view.sensor;
    nextSensor.set({ sensor, at });
    clearTimeout(timer);
    timer = setTimeout(
      () => {
        const next = nextSensor.get();
        if (next) act({ sensor: next.sensor.name });
      },
      Math.max(0, at - now()),
    );
  };

  update();
  const stop = store.subscribe(update);
  return () => {
    clearTimeout(timer);
    stop();
    nextSensor.set(null);
  };
}
