import { afterEach, beforeEach, expect, test, vi } from 'vitest';

import { started } from '../testing/life';
import { judgement } from '../testing/health';
import { readings, stateFrame, wireTag } from '../testing/tags';
import { connection, goLive, showTags, status } from '../testing/page';
import { act, prefer, receive } from './app';
import { hourAgo, startHourAgo } from './hourAgo';
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

const pass = (ms: number): Promise<unknown> => vi.advanceTimersByTimeAsync(ms);

test('an hour before now is asked for once, and again after some minutes', async () => {
  stop = started(startHourAgo);
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

test('where a day is a short one, so is its hour', async () => {
  goLive(status({ day_length_s: 1_440 }));
  receiveState(NOW_S);
  stop = started(startHourAgo);
  await pass(10);
  expect(Math.round(Number(requests[0]))).toBe(NOW_S - 60);
  goLive();
});

test('nothing is asked until the bridge has said how long an hour is', async () => {
  connection(performance.now(), { type: 'start', now: performance.now() });
  act({ moment: 50_000 });
  receive(withPast({ at: 50_000, house: NO_HOUSE }));
  stop = started(startHourAgo);
  await pass(1_000);
  expect(requests).toEqual([]);
  goLive(status({ day_length_s: 1_440 }));
  await pass(1_000);
  expect(requests.map(Number)).toEqual([49_940]);
  goLive();
});

test('of the moments that somebody drags through, few are fetched, and the last', async () => {
  stop = started(startHourAgo);
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
  stop = started(startHourAgo);
  await pass(1_000);
  receiveState(3_599);
  prefer({ hidden: [] });
  await pass(1_000);
  expect(requests).toEqual([]);
});

test('a twin that keeps no past is asked again after a while, not with each frame', async () => {
  answers = false;
  stop = started(startHourAgo);
  await pass(10);
  answers = true;
  receiveState(NOW_S + 1);
  await pass(1_500);
  expect(requests).toEqual([]);
  await pass(1_000);
  expect(requests).toHaveLength(1);
});
