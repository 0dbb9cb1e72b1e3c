import { afterEach, beforeEach, expect, test, vi } from 'vitest';

import { snapshotOf } from '../domain/twin';
import { timelineOf } from '../domain/timeline';
import { started } from '../testing/life';
import { readings, stateFrame, wireTag } from '../testing/tags';
import { npy, npyEstimate, npyField } from '../testing/field';
import { wireTimeline } from '../testing/timeline';
import { goLive, goLost, showTags, status } from '../testing/page';
import { act, receive, store } from './app';
import { selectHeat, selectMapped } from './derived';
import { startDifference } from './difference';
import { ready } from './fetcher';
import { NO_HOUSE, withPast } from './twin';

let requests: URLSearchParams[] = [];
/** The bridge's data of the shown moment, and of the one before. */
let known = { now: 22, then: 20.5, samplesThen: 1 };
let stop: () => void;

beforeEach(() => {
  vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout', 'setInterval', 'clearInterval'] });
  requests = [];
  known = { now: 22, then: 20.5, samplesThen: 1 };
  vi.stubGlobal('fetch', (url: URL) => {
    requests.push(url.searchParams);
    const isThen = url.searchParams.has('at');
    const value = isThen ? known.then : known.now;
    return Promise.resolve(
      new Response(npy([1, 2], [value, NaN]), {
        headers: {
          'X-Field-Origin-X': url.searchParams.get('bbox_min_x') ?? '',
          'X-Field-Origin-Y': url.searchParams.get('bbox_min_y') ?? '',
          'X-Field-Resolution': url.searchParams.get('resolution') ?? '',
          'X-Field-Value-Min': String(value),
          'X-Field-Value-Max': String(value),
          'X-Field-Sample-Count': String(isThen ? known.samplesThen : 1),
        },
      }),
    );
  });
  showTags([wireTag({ readings: readings({ temperature: 22 }) })]);
  goLive(status({ day_length_s: 60 }));
  stop = started(startDifference);
});
afterEach(() => {
  stop();
  act({ compare: null });
  vi.useRealTimers();
});

const settled = async (): Promise<void> => {
  await vi.advanceTimersByTimeAsync(500);
};

test('nothing is fetched while nothing is compared', async () => {
  await settled();
  expect(requests).toEqual([]);
});

test('both fields are fetched on one box, and their difference is the heat map', async () => {
  act({ compare: 'day' });
  // Until then nothing is shown as a difference.
  expect(selectHeat(store.get())).toBeNull();
  await settled();
  const { at = NaN, against } = store.get().twin.difference.value ?? {};
  expect(against).toBe(at - 60);
  expect(requests.map((query) => query.get('at'))).toEqual([null, (at - 60).toFixed(3)]);
  const boxes = requests.map((query) =>
    [...query].filter(([key]) => key.startsWith('bbox')).join(),
  );
  expect(new Set(boxes).size).toBe(1);
  expect(requests[0]?.get('bbox_max_y')).toBe('3.5');
  const heat = selectHeat(store.get());
  expect(heat?.field.values.slice(0, 6)).toEqual(Float32Array.of(1.5, 1.5, 1.5, NaN, NaN, NaN));
  expect(heat?.range).toEqual({ low: -1.5, high: 1.5 });
});

test('without data of then there is no heat map, and all of the map is marked as unknown', async () => {
  known.samplesThen = 0;
  act({ compare: 'day' });
  await settled();
  expect(store.get().twin.difference.state).toBe('ready');
  expect(selectHeat(store.get())).toBeNull();
  expect([...(selectMapped(store.get())?.values ?? [])]).toEqual([NaN, NaN]);
});

test('a moment without a tag has nothing to compare, instead of a difference on its way', async () => {
  act({ moment: 50 });
  const empty = snapshotOf(stateFrame([]), 0, null);
  receive(withPast({ at: 50, house: { ...NO_HOUSE, snapshot: empty } }));
  act({ compare: 'day' });
  await settled();
  expect(requests).toEqual([]);
  expect(store.get().twin.difference.value).toEqual({ field: null, at: 50, against: 50 });
});

test('while the twin is silent, the shown state keeps its own time', async () => {
  const at = (): number | undefined => store.get().twin.difference.value?.at;
  const clock = vi.spyOn(performance, 'now');
  clock.mockReturnValue(performance.now() + 60_000);
  act({ compare: 'day' });
  await settled();
  expect(at()).toBeGreaterThanOrEqual(160);
  clock.mockReturnValue(performance.now() + 5_000);
  goLive(status({ twin: 'offline', reason: 'stale', day_length_s: 60 }));
  await vi.advanceTimersByTimeAsync(5_000);
  expect(at()).toBeLessThan(160);
  clock.mockRestore();
});

test.each(['day', 'week'] as const)(
  'before all recorded data nothing is fetched of a %s ago',
  async (compare) => {
    const reach = { from: 1_000, to: 2_000 };
    receive({ remembered: ready(timelineOf(wireTimeline({ from: 0, to: 2_000, reach }), 2_000)) });
    act({ compare });
    await settled();
    expect(requests.map((query) => query.get('at'))).toEqual([null]);
    expect(selectMapped(store.get())?.sampleCount).toBe(0);
  },
);

test('no difference of one sensor is shown as that of another, nor after it ends', async () => {
  act({ compare: 'day' });
  await settled();
  act({ sensor: 'co2' });
  expect(selectHeat(store.get())).toBeNull();
  act({ sensor: 'temperature' });
  act({ compare: null });
  expect(store.get().twin.difference.value).toBeNull();
});

test('no difference of the past is shown live', async () => {
  const { latest } = store.get().twin;
  act({ moment: 600 });
  receive(withPast({ at: 600, house: latest }));
  act({ compare: 'week' });
  await settled();
  expect(store.get().twin.difference.value?.at).toBe(600);
  goLost();
  act({ moment: null });
  expect(store.get().twin.difference.value).toBeNull();
});

test('no difference of readings is shown as that of estimates', async () => {
  act({ compare: 'day' });
  await settled();
  expect(store.get().twin.difference.value).not.toBeNull();
  // Of then there is no estimate: the nearest readings in its place are not compared with one of now.
  vi.stubGlobal('fetch', (url: URL) => {
    const nearest = npyField([1, 2]);
    nearest.headers.set('X-Field-Resolution', '1');
    if (!url.pathname.endsWith('estimate.npy')) return Promise.resolve(nearest);
    return Promise.resolve(
      url.searchParams.has('at')
        ? Response.json({ detail: 'no model yet' }, { status: 400 })
        : npyEstimate([21, 22], [1, 1]),
    );
  });
  act({ heat: 'estimate' });
  expect(store.get().twin.difference.value).toBeNull();
  // The code of estimates loads first, which fake timers do not speed up.
  for (let look = 0; look < 1_000 && store.get().twin.difference.state === 'waiting'; look++) {
    await vi.dynamicImportSettled();
    await settled();
  }
  expect(store.get().twin.difference).toMatchObject({ state: 'failed', message: 'no model yet' });
  act({ heat: 'nearest' });
});
