import { afterEach, beforeEach, expect, test, vi } from 'vitest';

import { judgement } from '../testing/health';
import { readings, stateFrame, tag, wireTag } from '../testing/tags';
import { connection, goLive, showTags, status } from '../testing/page';
import { act, prefer, receive } from './app';
import { hourAgo, startHourAgo, thenOf } from './hourAgo';
import { NO_HOUSE, withPast, withState } from './twin';

const NOW_S = 100_000;

let requests: (string | null)[];
let answers: boolean;
let stop: () => void;

const receiveState = (sec: number): void => {
  const latest = stateFrame([wireTag()], { sec });
  receive(withState(latest, performance.now()));
};

beforeEach(() => {
  vi.useFakeTimers();
  requests = [];
  answers = true;
  vi.stubGlobal('fetch', (url: URL) => {
    if (!answers) return Promise.reject(new Error('no past'));
    const { pathname, searchParams } = url;
    const at = Number(searchParams.get('at'));
    if (pathname.endsWith('health')) return Promise.resolve(Response.json(judgement({})));
    requests.push(searchParams.get('at'));
    const tags = [wireTag({ readings: readings({ temperature: 20 }) })];
    return Promise.resolve(Response.json(stateFrame(tags, { sec: at }).state));
  });
  showTags([wireTag()]);
  receiveState(NOW_S);
});
afterEach(() => {
  stop();
  vi.useRealTimers();
});

/** Read now. */
const at = (temperature: number) => {
  const observed_at = { sec: NOW_S, nanosec: 0 };
  return tag({ readings: readings({ temperature }).map((it) => ({ ...it, observed_at })) });
};

const pass = (ms: number): Promise<unknown> => vi.advanceTimersByTimeAsync(ms);

test('an hour before now is asked for once, and again after some minutes', async () => {
  stop = startHourAgo();
  await pass(10);
  expect(hourAgo.get()?.tags.get('1')?.tag.readings.get('temperature')).toBe(20);
  for (const second of [1, 2, 100, 299]) {
    receiveState(NOW_S + second);
    await pass(10);
  }
  expect(requests).toHaveLength(1);
  expect(Math.round(Number(requests[0]))).toBe(NOW_S - 3_600);
  receiveState(NOW_S + 302);
  await pass(1_000);
  expect(requests).toHaveLength(2);
});

test('what a reading of now is compared with stays until there is a newer one', async () => {
  stop = startHourAgo();
  await pass(10);
  const first = hourAgo.get()?.tags.get('1');
  expect(thenOf(hourAgo.get(), at(22), 'temperature')).toBe(first);
  receiveState(NOW_S + 302);
  await pass(1_000);
  const second = hourAgo.get()?.tags.get('1');
  expect(second).not.toBe(first);
  expect(thenOf(hourAgo.get(), at(22), 'temperature')).toBe(first);
  expect(thenOf(hourAgo.get(), at(23), 'temperature')).toBe(second);
  // At a past moment it is the state an hour before, however the moment was reached.
  act({ moment: 50_000 });
  receive(withPast({ at: 50_000, house: NO_HOUSE }));
  await pass(1_000);
  expect(thenOf(hourAgo.get(), at(23), 'temperature')).not.toBe(second);
  expect(thenOf(null, at(23), 'temperature')).toBeNull();
});

test('a reading that is an hour old itself is compared with none that is older', async () => {
  stop = startHourAgo();
  await pass(10);
  const known = hourAgo.get();
  if (!known) throw new Error('nothing known');
  expect(thenOf(known, at(22), 'temperature')).toBe(known.tags.get('1'));
  const later = { tag: at(22), health: { verdict: 'healthy', reasons: [] } } as const;
  const next = { ...known, tags: new Map([['1', later]]) };
  expect(thenOf(next, at(22), 'temperature')).toBe(later);
});

test('where a day is a short one, so is its hour', async () => {
  goLive(status({ day_length_s: 1_440 }));
  receiveState(NOW_S);
  stop = startHourAgo();
  await pass(10);
  expect(Math.round(Number(requests[0]))).toBe(NOW_S - 60);
  goLive();
});

test('nothing is asked until the bridge has said how long an hour is', async () => {
  connection(performance.now(), { type: 'start', now: performance.now() });
  act({ moment: 50_000 });
  receive(withPast({ at: 50_000, house: NO_HOUSE }));
  stop = startHourAgo();
  await pass(1_000);
  expect(requests).toEqual([]);
  goLive(status({ day_length_s: 1_440 }));
  await pass(1_000);
  expect(requests.map(Number)).toEqual([49_940]);
  goLive();
});

test('of the moments that somebody drags through, few are fetched, and the last', async () => {
  stop = startHourAgo();
  await pass(10);
  for (const moment of [50_000, 50_100, 50_200]) {
    act({ moment });
    receive(withPast({ at: moment, house: NO_HOUSE }));
    await pass(100);
  }
  await pass(1_000);
  expect(requests.slice(1).map(Number)).toEqual([46_600]);
});

test('nobody asks for a trend that nobody wants to see, nor for what was before all time', async () => {
  prefer({ hidden: ['trend'] });
  stop = startHourAgo();
  await pass(1_000);
  receiveState(3_599);
  prefer({ hidden: [] });
  await pass(1_000);
  expect(requests).toEqual([]);
});

test('a twin that keeps no past is asked again after a while, not with each frame', async () => {
  answers = false;
  stop = startHourAgo();
  await pass(10);
  answers = true;
  receiveState(NOW_S + 1);
  await pass(1_500);
  expect(requests).toEqual([]);
  await pass(1_000);
  expect(requests).toHaveLength(1);
});
