import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import { createRefresher, type Task } from './refresher';

let values: string[];
let errors: unknown[];
let running: Map<string, { resolve: () => void; reject: (error: Error) => void; aborted: boolean }>;
let started: string[];

beforeEach(() => {
  vi.useFakeTimers();
  values = [];
  errors = [];
  started = [];
  running = new Map();
});
afterEach(() => {
  vi.useRealTimers();
});

const make = (): ReturnType<typeof createRefresher<string>> =>
  createRefresher<string>({
    intervalMs: 500,
    onValue: (value) => values.push(value),
    onError: (error) => errors.push(error),
  });

const task = (key: string, group = 'g'): Task<string> => ({
  key,
  group,
  run: (signal) =>
    new Promise((resolve, reject) => {
      started.push(key);
      const entry = {
        resolve: () => {
          resolve(key);
        },
        reject,
        aborted: false,
      };
      signal.addEventListener('abort', () => {
        entry.aborted = true;
      });
      running.set(key, entry);
    }),
});

const finish = async (key: string): Promise<void> => {
  running.get(key)?.resolve();
  await vi.advanceTimersByTimeAsync(0);
};

describe('refresher', () => {
  test('the first is fetched at once, the same key never again', async () => {
    const refresher = make();
    refresher.want(task('1'));
    expect(started).toEqual(['1']);
    await finish('1');
    refresher.want(task('1'));
    await vi.advanceTimersByTimeAsync(10_000);
    expect(started).toEqual(['1']);
    expect(values).toEqual(['1']);
  });

  test('many changes cost one fetch an interval, and the last one is fetched', async () => {
    const refresher = make();
    refresher.want(task('1'));
    for (const key of ['2', '3', '4']) refresher.want(task(key));
    await finish('1');
    expect(started).toEqual(['1']);
    await vi.advanceTimersByTimeAsync(500);
    expect(started).toEqual(['1', '4']);
    await finish('4');
    expect(values).toEqual(['1', '4']);
  });

  test('another group takes over and the old answer is not heard', async () => {
    const refresher = make();
    refresher.want(task('1', 'temperature'));
    refresher.want(task('2', 'humidity'));
    expect(running.get('1')?.aborted).toBe(true);
    expect(started).toEqual(['1', '2']);
    await finish('1');
    await finish('2');
    expect(values).toEqual(['2']);
  });

  test('a failure is told and tried again, ever more slowly', async () => {
    const refresher = make();
    refresher.want(task('1'));
    for (const pause of [2_000, 4_000, 8_000]) {
      running.get('1')?.reject(new Error('no'));
      await vi.advanceTimersByTimeAsync(pause - 1);
      const before = started.length;
      await vi.advanceTimersByTimeAsync(1);
      expect(started.length).toBe(before + 1);
    }
    expect(errors).toHaveLength(3);
    await finish('1');
    expect(values).toEqual(['1']);
  });

  test('nothing wanted, nothing fetched', async () => {
    const refresher = make();
    refresher.want(task('1'));
    refresher.want(null);
    expect(running.get('1')?.aborted).toBe(true);
    await vi.advanceTimersByTimeAsync(60_000);
    expect(started).toEqual(['1']);
  });
});
