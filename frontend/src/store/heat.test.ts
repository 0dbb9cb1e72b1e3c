import { afterEach, beforeEach, expect, test, vi } from 'vitest';

import { started } from '../testing/life';
import { npyEstimate, npyField } from '../testing/field';
import { goLost, showTags } from '../testing/page';
import { readings, stateFrame, wireTag } from '../testing/tags';
import { act, receive, store } from './app';
import { withState } from './twin';
import { selectHeat } from './derived';
import { startLoaders } from './loaders';

let requests: string[];
let refusal: number | null;
let stop: () => void;

const tags = [wireTag({ readings: readings({ temperature: 20 }) })];
const count = (part: string): number => requests.filter((url) => url.includes(part)).length;
const field = (): ReturnType<typeof store.get>['twin']['latest']['field'] =>
  store.get().twin.latest.field;
/** Receives another state only. */
const receiveState = (sec: number): void => {
  const latest = stateFrame(tags, { sec, revision: `heard ${sec}` });
  receive(withState(latest, performance.now()));
};
/** Waits for the code that loads with the first estimate: fake timers do not speed it up. */
const until = async (look: () => boolean): Promise<void> => {
  for (let attempts = 0; attempts < 1_000 && !look(); attempts++) {
    await vi.dynamicImportSettled();
    await vi.advanceTimersByTimeAsync(50);
  }
  expect(look()).toBe(true);
};

beforeEach(() => {
  vi.useFakeTimers();
  requests = [];
  refusal = null;
  vi.stubGlobal('fetch', (url: URL) => {
    requests.push(`${url.pathname}${url.search}`);
    if (url.pathname === '/api/field.npy') return Promise.resolve(npyField([1, 2]));
    if (url.pathname !== '/api/estimate.npy' || refusal !== null) {
      const detail = { detail: 'ten scans are needed' };
      return Promise.resolve(Response.json(detail, { status: refusal ?? 503 }));
    }
    return Promise.resolve(npyEstimate([21, 22, 23], [0.5, 1.2, 2]));
  });
  showTags([]);
  goLost();
  stop = started(startLoaders);
});
afterEach(() => {
  stop();
  vi.useRealTimers();
});

test('the estimate that is chosen takes the place of the nearest readings, with its errors', async () => {
  showTags(tags);
  await until(() => field().value !== null);
  expect(count('estimate')).toBe(0);
  act({ heat: 'estimate' });
  // Nothing else appears under the estimate's name.
  expect(selectHeat(store.get())).toBeNull();
  await until(() => field().value?.sureness !== undefined);
  expect(selectHeat(store.get())).toMatchObject({ isError: false, field: { valueMax: 22 } });
  act({ heat: 'error' });
  // Both arrived together.
  expect(selectHeat(store.get())?.isError).toBe(true);
  const before = count('estimate.npy');
  await vi.advanceTimersByTimeAsync(1_000);
  expect(count('estimate.npy')).toBe(before);
});

test('what is computed has no estimate: the nearest readings are asked for', async () => {
  showTags(tags);
  act({ sensor: 'vpd' });
  act({ heat: 'estimate' });
  await until(() => field().value !== null);
  expect(count('estimate')).toBe(0);
  expect(selectHeat(store.get())?.field).toMatchObject({ sensor: 'vpd', width: 6 });
});

test('it goes on with the time: what nobody reads becomes less sure', async () => {
  showTags(tags);
  act({ heat: 'estimate' });
  await until(() => count('estimate.npy') === 1);
  await vi.advanceTimersByTimeAsync(30_000);
  expect(count('estimate.npy')).toBe(4);
  act({ heat: 'nearest' });
  await vi.advanceTimersByTimeAsync(30_000);
  expect(count('estimate.npy')).toBe(4);
});

test('a house that changes ten times a second costs one estimate a second', async () => {
  showTags(tags);
  act({ heat: 'estimate' });
  await until(() => count('estimate.npy') === 1);
  for (let change = 0; change < 30; change++) {
    receiveState(1_000 + change);
    await vi.advanceTimersByTimeAsync(100);
  }
  expect(count('estimate.npy')).toBeLessThanOrEqual(5);
});

test('without an estimate, the nearest readings are shown, with the reason', async () => {
  refusal = 503;
  showTags(tags);
  act({ heat: 'estimate' });
  await until(() => field().value?.noEstimate !== undefined);
  expect(field().value?.noEstimate).toBe('ten scans are needed');
  expect(selectHeat(store.get())).toMatchObject({ isError: false, field: { sampleCount: 4 } });
  act({ heat: 'error' });
  expect(selectHeat(store.get())?.isError).toBe(false);
  refusal = null;
  await until(() => field().value?.sureness !== undefined);
});
