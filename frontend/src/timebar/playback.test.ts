import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import { act, receive, store } from '../store/app';
import { withState } from '../store/twin';
import { rosNow } from '../store/moment';
import { showTags } from '../testing/page';
import { stateFrame, wireTag } from '../testing/tags';
import { chooseSpeed, pause, play, playback, togglePlayback } from './playback';

beforeEach(() => {
  vi.useFakeTimers();
  showTags([wireTag()]);
  // Late enough for an hour to fit before now.
  const latest = stateFrame([], { sec: 100_000 });
  receive(withState(latest, performance.now()));
  chooseSpeed(300);
});
afterEach(() => {
  pause();
  expect(vi.getTimerCount()).toBe(0);
  vi.useRealTimers();
});

const moment = (): number | null => store.get().view.moment;

describe('playback', () => {
  test.each([60, 300, 900, 3_600] as const)('goes on %i seconds a second', (speed) => {
    chooseSpeed(speed);
    act({ moment: 90_000 });
    play();
    vi.advanceTimersByTime(1_000);
    expect(moment()).toBeCloseTo(90_000 + speed, 0);
  });

  test('has ten moments a second, and does not lag where one comes late', () => {
    act({ moment: 90_000 });
    play();
    const moments = new Set<number | null>();
    const stop = store.subscribe(() => moments.add(moment()));
    vi.advanceTimersByTime(1_000);
    stop();
    expect(moments.size).toBe(10);
    // The page was busy for three seconds while the clock went on.
    const at = performance.now();
    vi.spyOn(performance, 'now').mockReturnValue(at + 3_000);
    vi.advanceTimersByTime(100);
    expect(moment()).toBeGreaterThan(90_000 + 300 * 3.9);
  });

  test('begins at the beginning of the bar when now is shown', () => {
    act({ period: { kind: 'hour' } });
    play();
    const nowS = rosNow(store.get(), performance.now()) ?? 0;
    expect(moment()).toBeCloseTo(nowS - 3_600, 0);
  });

  test('ends in now', () => {
    act({ moment: 99_900 });
    play();
    vi.advanceTimersByTime(2_000);
    expect(moment()).toBeNull();
    expect(playback.get().isPlaying).toBe(false);
  });

  test('ends where somebody takes the moment elsewhere, and where nothing is remembered', () => {
    act({ moment: 90_000 });
    play();
    act({ moment: 80_000 });
    expect(playback.get().isPlaying).toBe(false);
    play();
    const fault = { at: 80_000, message: 'no journal is kept', isLasting: true };
    receive({ pastFault: fault });
    vi.advanceTimersByTime(200);
    expect(playback.get().isPlaying).toBe(false);
    expect(moment()).toBe(80_000);
    receive({ pastFault: null });
  });

  test('is begun and ended by one key; another speed holds at once', () => {
    act({ moment: 90_000 });
    togglePlayback();
    vi.advanceTimersByTime(1_000);
    chooseSpeed(3_600);
    vi.advanceTimersByTime(1_000);
    togglePlayback();
    expect(moment()).toBeCloseTo(90_000 + 300 + 3_600, 0);
    vi.advanceTimersByTime(5_000);
    expect(moment()).toBeCloseTo(90_000 + 300 + 3_600, 0);
  });
});
