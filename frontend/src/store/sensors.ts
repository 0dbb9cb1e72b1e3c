/** Fetches the file of sensors: at once, and again on each new connection, behind which may be another. */
import { fetchSensors } from '../contract/api';
import type { SensorsFile } from '../contract/types';
import { cataloguesOf } from '../domain/sensors';
import { act, receive, store } from './app';
import { createFetcher } from './fetcher';
import { DEFAULT_VIEW } from './view';

const INTERVAL_MS = 500;

export function startSensors(): () => void {
  let known = '';
  const sensors = createFetcher<SensorsFile>({
    paceMs: INTERVAL_MS,
    onValue: (file) => {
      const text = JSON.stringify(file);
      // The browser asks with its ETag, and mostly is told that it has it: nothing follows then.
      if (text === known) return;
      known = text;
      const value = cataloguesOf(file);
      receive({ type: 'sensors', sensors: { value, state: 'ready', message: '' } });
      // A file without what the page opens with: then the first that it has.
      const [first] = value.day.all;
      const { sensor } = store.get().view;
      const isChosen = sensor !== DEFAULT_VIEW.sensor || sensor in file.sensors;
      if (first && !isChosen) act({ type: 'sensor', sensor: first.name });
    },
    onError: (message) => {
      // What was in force before goes on: a bridge that is away has no other ranges.
      if (known === '') {
        receive({ type: 'sensors', sensors: { value: null, state: 'failed', message } });
      }
    },
  });
  const update = (): void => {
    // The first connection is made while this is fetched, and to the same bridge.
    const epoch = Math.max(1, store.get().twin.connection.epoch);
    sensors.want({ key: String(epoch), group: 'sensors', run: fetchSensors });
  };
  update();
  const stop = store.subscribe(update);
  return () => {
    stop();
    sensors.want(null);
  };
}
