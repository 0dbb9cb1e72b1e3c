import { afterEach, beforeEach, expect, test, vi } from 'vitest';

import type { deferred as Store, loadParts as Load, Parts } from './loadDeferred';

const PARTS = {} as Parts;
let deferred: typeof Store;
let loadParts: typeof Load;

beforeEach(async () => {
  vi.useFakeTimers();
  vi.resetModules();
  ({ deferred, loadParts } = await import('./loadDeferred'));
});
afterEach(() => {
  vi.useRealTimers();
});

test('they are loaded once, however many wait for them', async () => {
  const load = vi.fn(() => Promise.resolve(PARTS));
  const all = await Promise.all([loadParts(load), loadParts(load), loadParts(load)]);
  expect(all).toEqual([PARTS, PARTS, PARTS]);
  expect(load).toHaveBeenCalledTimes(1);
  expect(deferred.get()).toEqual({ parts: PARTS, isLate: false });
});

test('where they do not come it is told, and they are asked for again, ever less often', async () => {
  let isThere = false;
  const load = vi.fn(() =>
    isThere ? Promise.resolve(PARTS) : Promise.reject(new TypeError('gone')),
  );
  const coming = loadParts(load);
  for (const [pauseMs, attempts] of [
    [0, 1],
    [999, 1],
    [1, 2],
    [1_999, 2],
    [1, 3],
  ] as const) {
    await vi.advanceTimersByTimeAsync(pauseMs);
    expect(load).toHaveBeenCalledTimes(attempts);
    expect(deferred.get()).toEqual({ parts: null, isLate: true });
  }
  // 4, 8, 16 s, then every 30 s.
  await vi.advanceTimersByTimeAsync(28_000);
  expect(load).toHaveBeenCalledTimes(6);
  await vi.advanceTimersByTimeAsync(60_000);
  expect(load).toHaveBeenCalledTimes(8);
  isThere = true;
  await vi.advanceTimersByTimeAsync(30_000);
  expect(await coming).toBe(PARTS);
  expect(deferred.get()).toEqual({ parts: PARTS, isLate: false });
});
