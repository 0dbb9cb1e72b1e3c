import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import { started } from '../testing/life';
import { npyEstimate, npyField } from '../testing/field';
import { goLive, goLost, showTags } from '../testing/page';
import { judgement, reason } from '../testing/health';
import { readings, stateFrame, wireTag } from '../testing/tags';
import { act, receive, store } from './app';
import { withConnection, withPast } from './twin';
import { selectHealth, selectMapped } from './derived';
import { selectAwaited, selectShown } from './moment';
import { startQuality } from './loaders';
import { startPast } from './past';

interface SentRequest {
  readonly path: string;
  readonly at: number;
  readonly answer: (response?: Response) => Promise<void>;
  readonly signal: AbortSignal;
}

let requests: SentRequest[];
let stop: () => void;

const pass = (ms: number): Promise<unknown> => vi.advanceTimersByTimeAsync(ms);

/** As the server has it: at moment m the temperature was m. */
const usual = (path: string, at: number): Response => {
  if (path.endsWith('field.npy')) return npyField([at, at]);
  if (path.endsWith('estimate.npy')) return npyEstimate([at], [0.5]);
  if (path.endsWith('quality')) {
    return Response.json({
      ...{ sensor_type: 'temperature', unit: '°C', rmse: at, worst: null },
      ...{ sample_count: 1, judged_count: 1, painted_share: 1, far_off_tags: [] },
    });
  }
  if (path.endsWith('health')) return Response.json(judgement({ 1: [reason({ value: at })] }));
  const tag = wireTag({ readings: readings({ temperature: at }) });
  return Response.json(stateFrame([tag], { sec: at }).state);
};

beforeEach(() => {
  vi.useFakeTimers();
  requests = [];
  vi.stubGlobal(
    'fetch',
    (url: URL, { signal }: { signal: AbortSignal }) =>
      new Promise((resolve, reject) => {
        const at = Number(url.searchParams.get('at'));
        signal.addEventListener('abort', () => {
          reject(signal.reason as Error);
        });
        requests.push({
          path: url.pathname,
          at,
          signal,
          answer: async (response = usual(url.pathname, at)) => {
            resolve(response);
            await pass(0);
          },
        });
      }),
  );
  receive(withPast(null));
  showTags([wireTag({ readings: readings({ temperature: 1_000 }) })]);
  stop = started(startPast);
});
afterEach(async () => {
  act({ moment: null });
  stop();
  // What is fetched once a moment stays has not been requested yet.
  await pass(500);
  expect(vi.getTimerCount()).toBe(0);
  vi.useRealTimers();
});

/** The moment that the page states, and the data that it shows. */
const shown = (): unknown[] => {
  const { moment, snapshot, field } = selectShown(store.get());
  return [
    moment,
    snapshot?.tags[0]?.readings.get('temperature') ?? null,
    field.value?.values[0] ?? null,
  ];
};
const go = (moment: number | null): void => {
  act({ moment });
};
const answerAll = async (at: number): Promise<void> => {
  for (const each of requests.filter((one) => one.at === at)) await each.answer();
};

test('state, verdicts and field of a moment come together, or not at all', async () => {
  go(50);
  expect(requests.map(({ path, at }) => [path, at])).toEqual([
    ['/api/state', 50],
    ['/api/health', 50],
    ['/api/field.npy', 50],
  ]);
  await requests[0]?.answer();
  await requests[2]?.answer();
  expect(shown()).toEqual([null, 1_000, null]);
  await requests[1]?.answer();
  expect(shown()).toEqual([50, 50, 50]);
  expect(selectHealth(store.get()).byTag.get('1')?.reasons[0]?.value).toBe(50);
});

test('while another moment is on its way, the last that came stays with its own time', async () => {
  go(50);
  await answerAll(50);
  go(40);
  await pass(100);
  expect(shown()).toEqual([50, 50, 50]);
  expect(selectAwaited(store.get())).toBe(40);
  await answerAll(40);
  expect(shown()).toEqual([40, 40, 40]);
  expect(selectAwaited(store.get())).toBeNull();
});

test('now stays, as now, until the first moment is there; a slow one leaves nothing', async () => {
  go(50);
  await pass(299);
  expect(shown()).toEqual([null, 1_000, null]);
  go(49);
  await pass(1);
  expect(shown()).toEqual([49, null, null]);
  await answerAll(50);
  expect(shown()).toEqual([50, 50, 50]);
});

test('a link that is opened shows nothing before its moment has come', async () => {
  vi.resetModules();
  const fresh = {
    ...(await import('./app')),
    ...(await import('./moment')),
    ...(await import('./past')),
  };
  fresh.act({ moment: 50 });
  const end = started(fresh.startPast);
  const { moment, snapshot } = fresh.selectShown(fresh.store.get());
  expect([moment, snapshot]).toEqual([50, null]);
  await answerAll(50);
  expect(fresh.selectShown(fresh.store.get()).snapshot?.tags).toHaveLength(1);
  end();
});

test('back to now is at once, and what comes later is passed over', async () => {
  go(50);
  await answerAll(50);
  go(40);
  await pass(100);
  go(null);
  expect(shown()).toEqual([null, 1_000, null]);
  expect(requests.filter(({ at }) => at === 40).every(({ signal }) => signal.aborted)).toBe(true);
  await answerAll(40);
  expect(shown()).toEqual([null, 1_000, null]);
  // Not the last look back either.
  go(30);
  expect(shown()).toEqual([null, 1_000, null]);
});

test('another sensor never has the colours of the one before', async () => {
  go(50);
  await answerAll(50);
  expect(selectMapped(store.get())?.sensor).toBe('temperature');
  act({ sensor: 'co2' });
  expect(selectMapped(store.get())).toBeNull();
});

describe('what cannot be had', () => {
  test('leaves the last moment, with its own time, and is told', async () => {
    go(50);
    await answerAll(50);
    go(40);
    await pass(100);
    await requests.at(-3)?.answer(Response.json({ detail: 'busy' }, { status: 503 }));
    expect(shown()).toEqual([50, 50, 50]);
    expect(store.get().twin.pastFault).toEqual({ at: 40, message: 'busy', isLasting: false });
    await pass(2_000);
    await answerAll(40);
    expect(shown()).toEqual([40, 40, 40]);
    expect(store.get().twin.pastFault).toBeNull();
  });

  test('of the moment shows no state, and not the current one', async () => {
    go(50);
    await requests[0]?.answer(Response.json({ detail: 'at is later than now' }, { status: 400 }));
    expect(shown()).toEqual([50, null, null]);
    expect(store.get().twin.pastFault).toMatchObject({ at: 50, isLasting: true });
    go(null);
    expect(store.get().twin.pastFault).toBeNull();
  });

  test('of the field alone leaves the state, and says why', async () => {
    go(50);
    await requests[0]?.answer();
    await requests[1]?.answer();
    await requests[2]?.answer(Response.json({ error_message: 'too many cells' }, { status: 400 }));
    expect(shown()).toEqual([50, 50, null]);
    expect(selectShown(store.get()).field).toMatchObject({
      state: 'failed',
      message: 'too many cells',
    });
  });
});

test('each connection asks anew, a lost one does not', async () => {
  go(50);
  await answerAll(50);
  const before = requests.length;
  goLost();
  await pass(1_000);
  const states = (): number =>
    requests.slice(before).filter(({ path }) => path.endsWith('state')).length;
  expect(states()).toBe(0);
  goLive();
  const { connection } = store.get().twin;
  receive(withConnection({ ...connection, epoch: 9 }, performance.now()));
  await pass(100);
  expect(states()).toBe(1);
});

test('how far off the field is, is asked for once the moment stays', async () => {
  go(50);
  const stopQuality = started(startQuality);
  await answerAll(50);
  await pass(300);
  go(40);
  await pass(100);
  await answerAll(40);
  expect(requests.some(({ path }) => path.endsWith('quality'))).toBe(false);
  await pass(400);
  await requests.at(-1)?.answer();
  expect(selectShown(store.get()).quality).toMatchObject({ rmse: 40 });
  expect(shown()).toEqual([40, 40, 40]);
  // A refetched field, on another connection, has none yet.
  const { connection } = store.get().twin;
  receive(withConnection({ ...connection, epoch: 9 }, performance.now()));
  await pass(100);
  await answerAll(40);
  expect(selectShown(store.get()).quality).toBeNull();
  await pass(400);
  await requests.at(-1)?.answer();
  expect(selectShown(store.get()).quality).toMatchObject({ rmse: 40 });
  stopQuality();
});

test('an estimate that is chosen goes the same way: with its state, the newest first, two at once', async () => {
  act({ heat: 'estimate' });
  for (let at = 10; at < 20; at++) {
    go(at);
    await vi.dynamicImportSettled();
    await pass(100);
  }
  const states = requests.filter(({ path }) => path === '/api/state');
  expect(states.filter(({ signal }) => !signal.aborted)).toHaveLength(2);
  const { at = 0 } = states.at(-1) ?? {};
  await answerAll(at);
  expect(requests.some(({ path }) => path === '/api/field.npy')).toBe(false);
  await answerAll(at);
  expect(shown()).toEqual([at, at, at]);
  expect(selectShown(store.get()).field.value?.sureness?.sdKnown).toBe(1);
  const stopQuality = started(startQuality);
  await pass(2_000);
  // The error of the nearest readings is not needed.
  expect(requests.some(({ path }) => path.endsWith('field/quality'))).toBe(false);
  stopQuality();
});

test('before all data there is no estimate to ask for, even if a link leads there', async () => {
  act({ heat: 'estimate' });
  go(8);
  for (const { path, answer } of [...requests]) {
    await answer(
      path === '/api/state' ? Response.json(stateFrame([], { sec: 8 }).state) : undefined,
    );
  }
  expect(selectShown(store.get())).toMatchObject({ moment: 8, snapshot: { tags: [] } });
  expect(requests.map(({ path }) => path)).toEqual(['/api/state', '/api/health']);
});
