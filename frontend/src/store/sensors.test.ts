import { afterEach, beforeEach, expect, test, vi } from 'vitest';

import { started } from '../testing/life';
import { CATALOGUES, FILE, sensorNamed } from '../testing/sensors';
import { goLive, goLost, showTags } from '../testing/page';
import { judgement } from '../testing/health';
import { wireTag } from '../testing/tags';
import { act, receive, store } from './app';
import { withConnection } from './twin';
import { selectHeat, selectSensor, selectSensors } from './derived';
import { startSensors } from './loaders';
import { NOTHING } from './fetcher';

const answer = vi.fn<() => Promise<Response>>();
let stop = (): void => undefined;

const fileWith = (sensors: Record<string, unknown>): Promise<Response> =>
  Promise.resolve(Response.json({ ...FILE, sensors }));

const come = (): Promise<unknown> => vi.advanceTimersByTimeAsync(600);

beforeEach(() => {
  vi.useFakeTimers();
  answer.mockReset();
  answer.mockImplementation(() => fileWith(FILE.sensors));
  vi.stubGlobal('fetch', answer);
  showTags([wireTag()]);
  receive({ sensors: NOTHING });
});

afterEach(() => {
  stop();
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

test('before the answer has come no sensor has a range, and no heat map a colour', async () => {
  expect(selectSensors(store.get()).map(({ name }) => name)).toEqual(['temperature']);
  expect(selectSensor(store.get()).ideal).toBeNull();
  expect(selectHeat(store.get())).toBeNull();
  stop = started(startSensors);
  await come();
  expect(selectSensor(store.get())).toMatchObject({ label: 'Temperature', ideal: [18, 26] });
});

test('is asked for again on each new connection, and only another answer changes anything', async () => {
  stop = started(startSensors);
  await come();
  goLive();
  await come();
  expect(answer).toHaveBeenCalledTimes(1);
  const known = store.get().twin.sensors;
  goLost();
  receive(withConnection({ ...store.get().twin.connection, epoch: 2 }, performance.now()));
  await come();
  expect(answer).toHaveBeenCalledTimes(2);
  expect(store.get().twin.sensors).toBe(known);
  answer.mockImplementation(() => fileWith({ temperature: { ...FILE.fallback, ideal: [1, 2] } }));
  receive(withConnection({ ...store.get().twin.connection, epoch: 3 }, performance.now()));
  await come();
  expect(selectSensor(store.get()).ideal).toEqual([1, 2]);
});

test('a failure is told, is tried again, and takes away nothing that is known', async () => {
  answer.mockImplementation(() =>
    Promise.resolve(new Response('{"detail":"busy"}', { status: 503 })),
  );
  stop = started(startSensors);
  await come();
  expect(store.get().twin.sensors).toEqual({ value: null, state: 'failed', message: 'busy' });
  answer.mockImplementation(() => fileWith(FILE.sensors));
  await vi.advanceTimersByTimeAsync(3_000);
  expect(store.get().twin.sensors.state).toBe('ready');
});

test('a file without the sensor that the page opens with shows its first, unless one is chosen', async () => {
  answer.mockImplementation(() => fileWith({ ph: FILE.fallback, ec: FILE.fallback }));
  stop = started(startSensors);
  await come();
  expect(store.get().view.sensor).toBe('ph');
  stop();
  act({ sensor: 'humidity' });
  receive({ sensors: NOTHING });
  stop = started(startSensors);
  await come();
  expect(store.get().view.sensor).toBe('humidity');
});

test('ranges are of the day or of the night, as the judge says', () => {
  receive({ sensors: { value: FILE, state: 'ready', message: '' } });
  expect(selectSensor(store.get()).ideal).toEqual(sensorNamed('temperature').ideal);
  showTags([wireTag()], judgement({}, { is_day: false, source: 'clock' }));
  expect(selectSensor(store.get()).ideal).toEqual(CATALOGUES.night.named('temperature').ideal);
});
