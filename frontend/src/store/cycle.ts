/** On a wall screen, on wish: another sensor every so many seconds. */
import { now } from '../clock';
import { cycleWish, sensorAfter, sensorsOf, type CycleWish } from '../domain/cycle';
import type { Sensor } from '../domain/sensors';
import { act, store, type AppState } from './app';
import { createStore } from './create';
import { selectSensors } from './derived';
import { memoLast } from './memo';
import { selectTags } from './moment';

/** What comes next, and when, ms on the page's clock; null: the sensor in view stays. */
export interface Next {
  readonly sensor: Sensor;
  readonly at: number;
}

export const nextSensor = createStore<Next | null, Next | null>(null, (_, next) => next);

const round = memoLast(sensorsOf);

const after = ({ view }: AppState, sensors: readonly Sensor[]): Sensor | null =>
  // What once was is looked at in peace.
  view.moment === null ? sensorAfter(sensors, view.sensor) : null;

/** What the page's address asks for. */
export const askedCycle = (): CycleWish => cycleWish(window.location.search);

/** Begins the round; returns its end. */
export function startCycle({ seconds }: CycleWish): () => void {
  if (seconds === null) return () => undefined;
  let timer: ReturnType<typeof setTimeout> | undefined;
  let shown: string | null = null;

  const update = (): void => {
    const state = store.get();
    const sensor = after(state, round(selectTags(state), selectSensors(state)));
    const before = nextSensor.get();
    if (sensor === null) {
      clearTimeout(timer);
      shown = null;
      nextSensor.dispatch(null);
      return;
    }
    // Whoever chooses a sensor by hand has it for as long as any other.
    const isSame = before !== null && shown === state.view.sensor;
    const at = isSame ? before.at : now() + seconds * 1000;
    if (isSame && before.sensor === sensor) return;
    shown = state.view.sensor;
    nextSensor.dispatch({ sensor, at });
    clearTimeout(timer);
    timer = setTimeout(
      () => {
        const next = nextSensor.get();
        if (next) act({ type: 'sensor', sensor: next.sensor.name });
      },
      Math.max(0, at - now()),
    );
  };

  update();
  const stop = store.subscribe(update);
  return () => {
    clearTimeout(timer);
    stop();
    nextSensor.dispatch(null);
  };
}
