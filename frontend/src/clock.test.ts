import { beforeEach, describe, expect, test, vi } from 'vitest';

import type * as Clock from './clock';

const LAPSE_MS = 2_000;

const HOUR = 3_600_000;
let monotonic: number;
let wall: number;
let clock: typeof Clock;
let lapses: number;

/** Both clocks go on. */
const pass = (ms: number): void => {
  monotonic += ms;
  wall += ms;
};

beforeEach(async () => {
  monotonic = 1_000;
  wall = 1_700_000_000_000;
  lapses = 0;
  vi.spyOn(performance, 'now').mockImplementation(() => monotonic);
  vi.spyOn(Date, 'now').mockImplementation(() => wall);
  vi.resetModules();
  clock = await import('./clock');
  clock.lapses.addEventListener('lapse', () => (lapses += 1));
});

describe('a lapse', () => {
  test('is none while both clocks go on, however long nobody looks', () => {
    pass(40 * HOUR);
    expect(clock.now()).toBe(monotonic);
    expect(lapses).toBe(0);
  });

  test('is a wall clock that ran ahead: a sleep, or one that was set', () => {
    wall += LAPSE_MS;
    clock.now();
    expect(lapses).toBe(0);
    wall += LAPSE_MS + 1;
    clock.now();
    expect(lapses).toBe(1);
    pass(HOUR);
    clock.now();
    expect(lapses).toBe(1);
  });

  test('is none where the clock is slewed, if it takes days', () => {
    for (let i = 0; i < 10_000; i++) {
      pass(60_000);
      wall += 30;
      clock.now();
    }
    expect(lapses).toBe(0);
  });

  test('is none where the clock is set back: the monotonic one is right', () => {
    wall -= 10 * HOUR;
    clock.now();
    wall += LAPSE_MS;
    clock.now();
    expect(lapses).toBe(0);
  });

  test('is reported before the time is returned, and once', () => {
    const seen: number[] = [];
    clock.lapses.addEventListener('lapse', () => seen.push(clock.now()));
    wall += HOUR;
    seen.push(clock.now());
    expect(seen).toEqual([1_000, 1_000]);
    expect(lapses).toBe(1);
  });
});

describe('time of day', () => {
  test('of what came before a sleep is as it was then', () => {
    const [came, at] = [clock.now(), wall];
    pass(5_000);
    clock.now();
    wall += 8 * HOUR;
    pass(1_000);
    const [later, after] = [clock.now(), wall];
    expect(clock.epochOf(came)).toBe(at);
    expect(clock.epochOf(later)).toBe(after);
    wall += HOUR;
    clock.now();
    expect(clock.epochOf(came)).toBe(at);
  });

  test('follows a clock that was set back, and no lapse that nobody has looked for', () => {
    const [came, at] = [clock.now(), wall];
    wall += HOUR;
    expect(clock.epochOf(came)).toBe(at);
    wall -= 3 * HOUR;
    expect(clock.epochOf(came)).toBe(wall);
    clock.now();
    expect(clock.epochOf(came)).toBe(wall);
  });
});
