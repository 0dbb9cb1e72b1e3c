import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import { pauseAfterFailure, reloadByItself } from './reload';

const session = (): Pick<Storage, 'getItem' | 'setItem'> => {
  const stored = new Map<string, string>();
  return {
    getItem: (key) => stored.get(key) ?? null,
    setItem: (key, value) => stored.set(key, value),
  };
};

describe('pause before a reload', () => {
  test('grows from reload to reload, up to five minutes, and never is none', () => {
    const stored = session();
    const pauses = Array.from({ length: 9 }, (_, i) => pauseAfterFailure(stored, i * 1_000, 1));
    expect(pauses.slice(0, 4)).toEqual([5_000, 10_000, 20_000, 40_000]);
    expect(pauses.at(-1)).toBe(300_000);
    expect(pauseAfterFailure(session(), 0, 0)).toBe(2_500);
  });

  test('begins afresh once the page has held for ten minutes', () => {
    const stored = session();
    pauseAfterFailure(stored, 0, 1);
    expect(pauseAfterFailure(stored, 599_999, 1)).toBe(10_000);
    expect(pauseAfterFailure(stored, 1_199_999, 1)).toBe(5_000);
  });

  test('a clock that was set back does not make it hot', () => {
    const stored = session();
    pauseAfterFailure(stored, 1e12, 1);
    expect(pauseAfterFailure(stored, 0, 1)).toBe(10_000);
  });

  test.each(['{', 'null', '7', '{"failures":"x","at":0}', '{"failures":1}'])(
    'what is damaged counts as nothing: %s',
    (text) => {
      const stored = session();
      stored.setItem('lupin-twin.reload', text);
      expect(pauseAfterFailure(stored, 0, 1)).toBe(5_000);
    },
  );

  test('is the longest where nothing can be kept', () => {
    const refuse = (): never => {
      throw new Error('forbidden');
    };
    expect(pauseAfterFailure({ getItem: refuse, setItem: refuse }, 0, 1)).toBe(300_000);
  });
});

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
    reloadByItself(session(), reload);
    await vi.advanceTimersByTimeAsync(2_400);
    expect(answers).toHaveLength(2);
    await vi.advanceTimersByTimeAsync(7_000);
    expect(answers).toHaveLength(0);
    expect(reload).not.toHaveBeenCalled();
    await vi.advanceTimersByTimeAsync(4_000);
    expect(reload).toHaveBeenCalledOnce();
  });

  test('stopped is stopped', async () => {
    vi.stubGlobal('fetch', () => Promise.resolve(new Response('page')));
    const reload = vi.fn();
    reloadByItself(session(), reload)();
    await vi.advanceTimersByTimeAsync(600_000);
    expect(reload).not.toHaveBeenCalled();
  });
});
