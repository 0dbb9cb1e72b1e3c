import { expect, test, vi } from 'vitest';

import { createStore } from './create';

test('notifies of changes only, and only current listeners', () => {
  const store = createStore(1);
  const listener = vi.fn();
  const stop = store.subscribe(listener);
  store.set(1);
  expect(listener).not.toHaveBeenCalled();
  store.set(2);
  expect(listener).toHaveBeenCalledTimes(1);
  stop();
  store.set(3);
  expect(listener).toHaveBeenCalledTimes(1);
  expect(store.get()).toBe(3);
});

test('a failing listener does not stop the others, and is reported', () => {
  const failures: unknown[] = [];
  vi.spyOn(globalThis, 'queueMicrotask').mockImplementation((task) => {
    try {
      task();
    } catch (error) {
      failures.push(error);
    }
  });
  const store = createStore(1);
  const listener = vi.fn();
  const failure = new Error('broken');
  store.subscribe(() => {
    throw failure;
  });
  store.subscribe(listener);
  store.set(2);
  expect(listener).toHaveBeenCalledTimes(1);
  expect(failures).toEqual([failure]);
});
