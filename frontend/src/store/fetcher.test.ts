import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import { Refusal } from '../contract/api';
import { S } from '../strings';
import { createFetcher, DRAG_PACE_MS, type FetchTask } from './fetcher';

let received: string[];
let errors: { message: string; isLasting: boolean }[];
let started: string[];
let fetches: Map<string, { resolve: () => void; reject: (error: Error) => void; over: boolean }>;
let fetcher: ReturnType<typeof createFetcher<string>>;

beforeEach(() => {
  vi.useFakeTimers();
  received = [];
  errors = [];
  started = [];
  fetches = new Map();
  fetcher = make({ paceMs: DRAG_PACE_MS, isDragged: true });
});
afterEach(async () => {
  fetcher.want(null);
  await vi.advanceTimersByTimeAsync(0);
  expect(vi.getTimerCount()).toBe(0);
  vi.useRealTimers();
});

const make = (options: { paceMs: number; isDragged?: boolean }): typeof fetcher =>
  createFetcher<string>({
    ...options,
    onValue: (value) => received.push(value),
    onError: (message, isLasting) => errors.push({ message, isLasting }),
  });

const task = (key: string, group?: string): FetchTask<string> => ({
  key,
  ...(group === undefined ? {} : { group }),
  run: (signal) =>
    new Promise((resolve, reject) => {
      started.push(key);
      const entry = { resolve: (): void => undefined, reject, over: false };
      entry.resolve = (): void => {
        entry.over = true;
        resolve(key);
      };
      signal.addEventListener('abort', () => {
        entry.over = true;
        reject(signal.reason as Error);
      });
      fetches.set(key, entry);
    }),
});

const pass = (ms: number): Promise<unknown> => vi.advanceTimersByTimeAsync(ms);
const answer = async (key: string): Promise<void> => {
  fetches.get(key)?.resolve();
  await pass(0);
};
const fail = async (key: string, error: Error): Promise<void> => {
  fetches.get(key)?.reject(error);
  await pass(0);
};
const open = (): string[] => [...fetches].filter(([, { over }]) => !over).map(([key]) => key);

test('the first task is fetched at once', async () => {
  fetcher.want(task('a'));
  expect(started).toEqual(['a']);
  await answer('a');
  expect(received).toEqual(['a']);
});

describe('while dragging', () => {
  test('two fetches run, the latest task is next, and those between are dropped', async () => {
    for (const key of ['a', 'b', 'c', 'd', 'e']) {
      fetcher.want(task(key));
      await pass(100);
    }
    expect(started).toEqual(['a', 'b']);
    await answer('a');
    expect(started).toEqual(['a', 'b', 'e']);
    await answer('b');
    await answer('e');
    expect(received).toEqual(['a', 'b', 'e']);
  });

  test('a dozen a second are started, however fast the answers are', async () => {
    for (let index = 0; index < 100; index++) {
      fetcher.want(task(`${index}`));
      await pass(10);
      for (const key of open()) await answer(key);
    }
    expect(started.length).toBeGreaterThanOrEqual(12);
    expect(started.length).toBeLessThanOrEqual(13);
    await pass(100);
    await answer('99');
    expect(received.at(-1)).toBe('99');
  });

  test('an overtaken answer is dropped, and its fetch ends', async () => {
    fetcher.want(task('a'));
    await pass(100);
    fetcher.want(task('b'));
    await answer('b');
    expect(fetches.get('a')?.over).toBe(true);
    expect(received).toEqual(['b']);
  });

  test('but a fetch wanted again goes on, and is handed on', async () => {
    fetcher.want(task('a'));
    await pass(100);
    fetcher.want(task('b'));
    fetcher.want(task('a'));
    await answer('b');
    expect(received).toEqual(['b']);
    await answer('a');
    expect(received).toEqual(['b', 'a']);
    expect(started).toEqual(['a', 'b']);
  });

  test('where it comes to rest, slow fetches of what was passed end', async () => {
    for (const key of ['a', 'b', 'c']) {
      fetcher.want(task(key));
      await pass(100);
    }
    expect(open()).toEqual(['a', 'b']);
    await pass(250);
    expect(open()).toEqual(['c']);
    await answer('c');
    expect(received).toEqual(['c']);
  });
});

test('nothing wanted ends all, and leaves nothing behind', async () => {
  fetcher.want(task('a'));
  fetcher.want(null);
  expect(open()).toEqual([]);
  await pass(60_000);
  expect([received, errors]).toEqual([[], []]);
  fetcher.want(task('a'));
  await answer('a');
  expect(received).toEqual(['a']);
});

describe('a failure', () => {
  test('is reported, and retried ever more slowly', async () => {
    fetcher.want(task('a'));
    for (const pause of [2_000, 4_000, 8_000]) {
      await fail('a', new Error('down'));
      const before = started.length;
      await pass(pause - 1);
      expect(started.length).toBe(before);
      await pass(1);
      expect(started.length).toBe(before + 1);
    }
    await answer('a');
    expect(errors).toEqual(Array(3).fill({ message: 'down', isLasting: false }));
    expect(received).toEqual(['a']);
  });

  test('that will last is not retried', async () => {
    fetcher.want(task('a'));
    await fail('a', new Refusal(400, 'never'));
    await pass(120_000);
    expect(errors).toEqual([{ message: 'never', isLasting: true }]);
    expect(started).toEqual(['a']);
  });

  test('of an unwanted task is not reported, but Retry-After is honoured', async () => {
    fetcher.want(task('a'));
    await pass(100);
    fetcher.want(task('b'));
    await fail('a', new Refusal(429, 'too much', 3));
    expect(errors).toEqual([]);
    await answer('b');
    fetcher.want(task('c'));
    await pass(2_800);
    expect(started).toEqual(['a', 'b']);
    await pass(200);
    expect(started).toEqual(['a', 'b', 'c']);
  });

  test('is also that no answer comes', async () => {
    fetcher.want(task('a'));
    await pass(30_000);
    expect(errors).toEqual([{ message: S.serverBusy, isLasting: false }]);
  });

  test.each([
    [429, 7, 7_000],
    [503, 3, 3_000],
    [503, 3_600, 60_000],
  ])(
    'for load (%i) is reported in plain words, and retried in %i s at the latest',
    async (...of) => {
      const [status, retryAfterS, waitMs] = of;
      fetcher.want(task('a'));
      await fail('a', new Refusal(status, 'client_rate', retryAfterS));
      expect(errors).toEqual([{ message: S.serverBusy, isLasting: false }]);
      await pass(waitMs - 1);
      expect(started).toEqual(['a']);
      await pass(1);
      expect(started).toEqual(['a', 'a']);
    },
  );

  test('is also that there is no network', async () => {
    fetcher.want(task('a'));
    await fail('a', new TypeError('Failed to fetch'));
    expect(errors).toEqual([{ message: S.serverBusy, isLasting: false }]);
  });
});

describe('a value kept up to date', () => {
  beforeEach(() => {
    fetcher = make({ paceMs: 500 });
  });

  test('is fetched at once, and never again for the same key', async () => {
    fetcher.want(task('1'));
    expect(started).toEqual(['1']);
    await answer('1');
    fetcher.want(task('1'));
    await pass(10_000);
    expect([started, received]).toEqual([['1'], ['1']]);
  });

  test('costs one fetch a pace, however often it changes, and the last change is fetched', async () => {
    for (const key of ['1', '2', '3', '4']) fetcher.want(task(key));
    await answer('1');
    expect(started).toEqual(['1']);
    await pass(500);
    expect(started).toEqual(['1', '4']);
    await answer('4');
    expect(received).toEqual(['1', '4']);
  });

  test('gives way to another group at once', async () => {
    fetcher.want(task('1', 'temperature'));
    fetcher.want(task('2', 'humidity'));
    expect(open()).toEqual(['2']);
    expect(started).toEqual(['1', '2']);
    await answer('2');
    expect(received).toEqual(['2']);
  });

  test('is tried again ever more slowly, though it has changed meanwhile and though it was refused', async () => {
    for (const [index, pause] of [2_000, 4_000, 8_000].entries()) {
      fetcher.want(task(`${index}`));
      await pass(0);
      await fail(`${index}`, new Refusal(400, 'not yet'));
      fetcher.want(task(`${index + 1}`));
      await pass(pause - 1);
      expect(started).toHaveLength(index + 1);
      await pass(1);
      expect(started).toHaveLength(index + 2);
    }
    expect(errors).toHaveLength(3);
  });
});
