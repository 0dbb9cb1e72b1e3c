import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import { started } from '../testing/life';
import { goLive, goLost, showTags } from '../testing/page';
import { stateFrame, wireTag } from '../testing/tags';
import { wireTimeline } from '../testing/timeline';
import { act, receive, store } from './app';
import { fromFragment } from './address';
import { requestedSpan, startOpening, startRemembered, turnOf } from './remembered';
import { withConnection, withState } from './twin';
import { NOTHING } from './fetcher';

let requests: URLSearchParams[];
let answer: () => Response;
let stop: () => void;

beforeEach(() => {
  vi.useFakeTimers();
  requests = [];
  answer = () => Response.json(wireTimeline({ from: 0, to: 240 }));
  vi.stubGlobal('fetch', (url: URL) => {
    requests.push(url.searchParams);
    return Promise.resolve(answer());
  });
  receive({ remembered: NOTHING });
  showTags([wireTag()]);
  stop = started(startRemembered);
});
afterEach(() => {
  stop();
  expect(vi.getTimerCount()).toBe(0);
  vi.useRealTimers();
});

const pass = (ms: number): Promise<unknown> => vi.advanceTimersByTimeAsync(ms);

describe('what is asked', () => {
  test('is whole buckets, so that those that have passed stay the same', () => {
    const first = requestedSpan({ kind: 'hour' }, 1_000_007, null);
    const next = requestedSpan({ kind: 'hour' }, 1_000_009, null);
    expect(first).toEqual({ from: 996_420, to: 1_000_020 });
    expect(next).toEqual(first);
    expect(requestedSpan({ kind: 'hour' }, 1_000_021, null)).toEqual({
      from: 996_450,
      to: 1_000_050,
    });
  });

  test('is all there is, or exactly what was chosen', () => {
    expect(requestedSpan({ kind: 'all' }, 50, null)).toBeNull();
    expect(requestedSpan({ kind: 'own', from: 3, to: 10 }, 50, 5)).toEqual({ from: 3, to: 10 });
  });

  test('is asked again once a bucket, and at least every half minute; not of what is over', () => {
    const turns = (period: Parameters<typeof turnOf>[0]): number =>
      new Set(Array.from({ length: 600 }, (_, s) => turnOf(period, 1e9 + s))).size;
    const short = { kind: 'own', from: 1e9 - 600, to: 1e9 + 600 } as const;
    expect([turns(short), turns({ kind: 'day' }), turns({ kind: 'all' })]).toEqual([60, 21, 21]);
    expect(turnOf({ kind: 'own', from: 3, to: 10 }, 50)).toBe(0);
    expect(turnOf({ kind: 'own', from: 3, to: 1e9 }, 50)).not.toBe(0);
  });
});

test('it is fetched when there is a twin, and again as time goes on', async () => {
  await pass(0);
  expect(store.get().twin.remembered).toMatchObject({ state: 'ready', value: { to: 240 } });
  expect(requests).toHaveLength(1);
  await pass(31_000);
  expect(requests.length).toBeGreaterThan(1);
});

test('of a young twin the period is fetched again, from where its history begins', async () => {
  receive(withState(stateFrame([wireTag()], { sec: 1_000_000 }), performance.now()));
  const reach = { from: 999_000, to: 1_000_000 };
  answer = () => Response.json(wireTimeline({ from: 996_400, to: 1_000_000, reach }));
  act({ period: { kind: 'hour' } });
  await pass(3_000);
  const begins = requests.slice(1).map((query) => Number(query.get('from')));
  expect(begins).toEqual([996_420, 999_000]);
});

test('another period is fetched at once, and nothing of the last is left', async () => {
  await pass(0);
  answer = () => Response.json({ detail: 'busy' }, { status: 503 });
  act({ period: { kind: 'all' } });
  expect(store.get().twin.remembered).toEqual(NOTHING);
  await pass(0);
  expect(requests.at(-1)?.has('from')).toBe(false);
  expect(store.get().twin.remembered).toMatchObject({ state: 'failed', message: 'busy' });
});

test('a link that names no period brings back what the page opens on, at once', async () => {
  const stopOpening = started(startOpening);
  const latest = stateFrame([wireTag()], { sec: 1_000_000, revision: 'r' });
  receive(withState(latest, performance.now()));
  answer = () => Response.json(wireTimeline({ from: 0, to: 240, reach: { from: 0, to: 240 } }));
  await pass(1_100);
  expect(store.get().view.period).toEqual({ kind: 'hour' });
  // Also twice, before any refetch.
  for (const layers of ['map', 'map,pins']) {
    act(fromFragment(`layers=${layers}`));
    await pass(100);
  }
  await pass(1_000);
  expect(store.get().view.period).toEqual({ kind: 'hour' });
  expect(store.get().twin.remembered.state).toBe('ready');
  const spans = requests.map((query) => Number(query.get('to')) - Number(query.get('from')));
  expect(spans.slice(1)).toEqual([3_600, 3_600, 3_600]);
  stopOpening();
});

test('after a reconnect the gap is refilled', async () => {
  await pass(0);
  goLost();
  await pass(5_000);
  const before = requests.length;
  receive(withConnection({ ...store.get().twin.connection, epoch: 99 }, performance.now()));
  await pass(5_000);
  expect(requests).toHaveLength(before);
  goLive();
  const { connection } = store.get().twin;
  receive(withConnection({ ...connection, epoch: 99 }, performance.now()));
  await pass(2_000);
  expect(requests.length).toBeGreaterThan(before);
});

test('what fails for now leaves what there was', async () => {
  await pass(0);
  answer = () => Response.json({ detail: 'busy' }, { status: 503 });
  await pass(31_000);
  expect(store.get().twin.remembered).toMatchObject({
    state: 'failed',
    message: 'busy',
    value: { to: 240 },
  });
});
