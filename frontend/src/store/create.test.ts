import { expect, test, vi } from 'vitest';

import { createStore } from './create';

test('tells of changes only, and only those who still listen', () => {
  const store = createStore(1, (_, next: number) => next);
  const listener = vi.fn();
  const stop = store.subscribe(listener);
  store.dispatch(1);
  expect(listener).not.toHaveBeenCalled();
  store.dispatch(2);
  expect(listener).toHaveBeenCalledTimes(1);
  stop();
  store.dispatch(3);
  expect(listener).toHaveBeenCalledTimes(1);
  expect(store.get()).toBe(3);
});
