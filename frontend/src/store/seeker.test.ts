import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import { Refusal } from '../contract/api';
import { createSeeker, type Seeker, type Wish } from './seeker';

let told: string[];
let errors: { message: string; isLasting: boolean }[];
let started: string[];
let fetches: Map<string, { resolve: () => void; reject: (error: Error) => void; over: boolean }>;
let seeker: Seeker<string>;

beforeEach(() => {
  vi.useFakeTimers();
  told = [];
  errors = [];
  started = [];
  fetches = new Map();
  seeker = createSeeker<string>({
    onValue: (value) => told.push(value),
    onError: (error, isLasting) => errors.push({ message: (error as Error).message, isLasting }),
  });
});
afterEach(async () => {
  seeker.want(null);
  await vi.advanceTimersByTimeAsync(0);
  expect(vi.getTimerCount()).toBe(0);
  vi.useRealTimers();
});

const wish = (key: string): Wish<string> => ({
  key,
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

test('the first wish is fetched at once', async () => {
  seeker.want(wish('a'));
  expect(started).toEqual(['a']);
  await answer('a');
  expect(told).toEqual(['a']);
});

describe('while somebody drags', () => {
  test('two fetches run, the newest wish is the next, and those between are dropped', async () => {
    for (const key of ['a', 'b', 'c', 'd', 'e']) {
      seeker.want(wish(key));
      await pass(100);
    }
    expect(started).toEqual(['a', 'b']);
    await answer('a');
    expect(started).toEqual(['a', 'b', 'e']);
    await answer('b');
    await answer('e');
    expect(told).toEqual(['a', 'b', 'e']);
  });

  test('a dozen a second are started, however fast the answers are', async () => {
    for (let index = 0; index < 100; index++) {
      seeker.want(wish(`${index}`));
      await pass(10);
      for (const key of open()) await answer(key);
    }
    expect(started.length).toBeGreaterThanOrEqual(12);
    expect(started.length).toBeLessThanOrEqual(13);
    await pass(100);
    await answer('99');
    expect(told.at(-1)).toBe('99');
  });

  test('what is overtaken is never told, and its fetch ends', async () => {
    seeker.want(wish('a'));
    await pass(100);
    seeker.want(wish('b'));
    await answer('b');
    expect(fetches.get('a')?.over).toBe(true);
    expect(told).toEqual(['b']);
  });

  test('but what is wanted again goes on, and is told', async () => {
    seeker.want(wish('a'));
    await pass(100);
    seeker.want(wish('b'));
    seeker.want(wish('a'));
    await answer('b');
    expect(told).toEqual(['b']);
    await answer('a');
    expect(told).toEqual(['b', 'a']);
    expect(started).toEqual(['a', 'b']);
  });

  test('where it comes to rest, slow fetches of what was passed end', async () => {
    for (const key of ['a', 'b', 'c']) {
      seeker.want(wish(key));
      await pass(100);
    }
    expect(open()).toEqual(['a', 'b']);
    await pass(250);
    expect(open()).toEqual(['c']);
    await answer('c');
    expect(told).toEqual(['c']);
  });
});

test('what came a moment ago is there at once, but not for ever', async () => {
  seeker.want(wish('a'));
  await answer('a');
  await pass(100);
  seeker.want(wish('b'));
  await answer('b');
  seeker.want(wish('a'));
  expect(told).toEqual(['a', 'b', 'a']);
  expect(started).toEqual(['a', 'b']);
  await pass(31_000);
  seeker.want(wish('b'));
  expect(started).toEqual(['a', 'b', 'b']);
});

test('so many are kept, and the oldest goes', async () => {
  for (let index = 0; index <= 60; index++) {
    seeker.want(wish(`${index}`));
    await pass(100);
    await answer(`${index}`);
  }
  seeker.want(wish('1'));
  expect(told.at(-1)).toBe('1');
  seeker.want(wish('0'));
  await pass(100);
  expect(started.filter((key) => key === '0' || key === '1')).toEqual(['0', '1', '0']);
});

test('nothing wanted ends all, and leaves nothing behind', async () => {
  seeker.want(wish('a'));
  seeker.want(null);
  expect(open()).toEqual([]);
  await pass(60_000);
  expect([told, errors]).toEqual([[], []]);
  seeker.want(wish('a'));
  await answer('a');
  expect(told).toEqual(['a']);
});

describe('a failure', () => {
  test('is told, and tried again ever more slowly', async () => {
    seeker.want(wish('a'));
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
    expect(told).toEqual(['a']);
  });

  test.each([400, 404])('that will last (%i) is not tried again', async (status) => {
    seeker.want(wish('a'));
    await fail('a', new Refusal(status, 'never'));
    await pass(120_000);
    expect(errors).toEqual([{ message: 'never', isLasting: true }]);
    expect(started).toEqual(['a']);
  });

  test('of what nobody wants any more is no news, but a server that asks for peace gets it', async () => {
    seeker.want(wish('a'));
    await pass(100);
    seeker.want(wish('b'));
    await fail('a', new Refusal(429, 'too much', 3));
    expect(errors).toEqual([]);
    await answer('b');
    seeker.want(wish('c'));
    await pass(2_800);
    expect(started).toEqual(['a', 'b']);
    await pass(200);
    expect(started).toEqual(['a', 'b', 'c']);
  });

  test('is also that no answer comes', async () => {
    seeker.want(wish('a'));
    await pass(20_000);
    expect(errors).toEqual([{ message: 'no answer came in time', isLasting: false }]);
  });
});
