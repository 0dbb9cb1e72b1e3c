import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import { reloadByItself } from './reload';

describe('reload', () => {
  beforeEach(() => {
    vi.useFakeTimers();
  });
  afterEach(() => {
    vi.useRealTimers();
  });

  test('waits for its server: an error page of the browser would stay for ever', async () => {
    const answers = [
      () => Promise.reject(new Error('away')),
      () => Promise.resolve(new Response('', { status: 502 })),
    ];
    const well = (): Promise<Response> => Promise.resolve(new Response('page'));
    vi.stubGlobal('fetch', () => (answers.shift() ?? well)());
    vi.spyOn(Math, 'random').mockReturnValue(0);
    const reload = vi.fn();
    reloadByItself(reload);
    await vi.advanceTimersByTimeAsync(4_900);
    expect(answers).toHaveLength(2);
    await vi.advanceTimersByTimeAsync(10_200);
    expect(answers).toHaveLength(0);
    expect(reload).not.toHaveBeenCalled();
    await vi.advanceTimersByTimeAsync(10_000);
    expect(reload).toHaveBeenCalledOnce();
  });

  test('stopped is stopped', async () => {
    vi.stubGlobal('fetch', () => Promise.resolve(new Response('page')));
    const reload = vi.fn();
    reloadByItself(reload)();
    await vi.advanceTimersByTimeAsync(600_000);
    expect(reload).not.toHaveBeenCalled();
  });
});
