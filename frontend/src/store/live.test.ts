import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import { now } from '../clock';
import type { Frame } from '../contract/types';
import { ageSeconds } from '../domain/time';
import { started } from '../testing/life';
import { alarm, alarms } from '../testing/alarms';
import { status } from '../testing/page';
import { NOBODY } from '../testing/health';
import { readings, stateFrame, wireTag } from '../testing/tags';
import { store } from './app';
import { selectShown, shownTime } from './moment';
import { pauseMs, retryConnection, startLive } from './live';

class FakeSocket {
  static last: FakeSocket;
  static count = 0;
  onopen: (() => void) | null = null;
  onclose: ((event: { code: number }) => void) | null = null;
  onmessage: ((event: { data: string }) => void) | null = null;

  constructor(readonly url: string) {
    FakeSocket.last = this;
    FakeSocket.count += 1;
  }

  close(): void {
    // Nothing to close.
  }

  speak(frame: Frame): void {
    this.onmessage?.({ data: JSON.stringify(frame) });
  }
}

let stop: () => void;
const revision = (): string | undefined => store.get().twin.latest.snapshot?.revision;

beforeEach(() => {
  vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout', 'performance'] });
  vi.stubGlobal('WebSocket', FakeSocket);
  stop = started(startLive);
  FakeSocket.last.onopen?.();
});
afterEach(() => {
  stop();
  vi.useRealTimers();
});

test('goes to the server that the page came from', () => {
  expect(FakeSocket.last.url).toBe('ws://localhost:3000/ws/state?delta=1');
});

test('the first state is taken at once, as old as the bridge says', () => {
  FakeSocket.last.speak(status({ state_age_seconds: 12 }));
  FakeSocket.last.speak(stateFrame([wireTag()], { sec: 1, revision: 'first' }));
  expect(revision()).toBe('first');
  expect(store.get().twin.latest.snapshot?.takenAt).toBeCloseTo(performance.now() - 12_000, -1);
});

test('of many frames the newest is taken, a few times a second', () => {
  FakeSocket.last.speak(status());
  let changes = 0;
  const unsubscribe = store.subscribe(() => (changes += 1));
  for (let i = 0; i < 20; i++) {
    FakeSocket.last.speak(stateFrame([wireTag()], { seq: i, sec: 10 + i, revision: `r${i}` }));
    vi.advanceTimersByTime(100);
  }
  unsubscribe();
  vi.advanceTimersByTime(300);
  expect(revision()).toBe('r19');
  expect(changes).toBeLessThanOrEqual(10);
  expect(changes).toBeGreaterThan(5);
});

test('deltas are put together; one that does not fit makes a new connection', () => {
  const header = { stamp: 50, frame_id: 'map' };
  const delta = {
    type: 'delta',
    revision: 'd',
    header,
    changed: [],
    removed: [],
    health: NOBODY,
  } as const;
  FakeSocket.last.speak(status());
  FakeSocket.last.speak(stateFrame([wireTag()], { seq: 1, sec: 49 }));
  FakeSocket.last.speak({ ...delta, seq: 2, base: 1 });
  vi.advanceTimersByTime(300);
  expect(revision()).toBe('d');
  expect(store.get().twin.phase).toBe('live');
  FakeSocket.last.speak({ ...delta, seq: 9, base: 8 });
  expect(store.get().twin.phase).toBe('reconnecting');
  vi.advanceTimersByTime(1_000);
  expect(store.get().twin.connection.socket.kind).toBe('opening');
});

test('alarms are taken as they come, also before a state, and change nothing else', () => {
  FakeSocket.last.speak({ type: 'alarms', notes: 0, ...alarms([alarm('a')]) });
  expect(store.get().twin.alarms?.alarms).toEqual([alarm('a')]);
  expect(store.get().twin.phase).toBe('connecting');
  FakeSocket.last.speak(status());
  FakeSocket.last.speak(stateFrame([wireTag()], { sec: 70, revision: 'after alarms' }));
  FakeSocket.last.speak({ type: 'alarms', notes: 0, ...alarms([]) });
  expect(revision()).toBe('after alarms');
  expect(store.get().twin.alarms?.alarms).toEqual([]);
});

test('a large house is calmer', () => {
  expect(pauseMs(30)).toBe(250);
  expect(pauseMs(500)).toBe(1_000);
});

test('the operator can try at once', () => {
  FakeSocket.last.onclose?.({ code: 1006 });
  const before = FakeSocket.count;
  retryConnection();
  expect(FakeSocket.count).toBe(before + 1);
});

test('a bad message is told of for a minute after the last one', () => {
  const unread = (): number | undefined => store.get().twin.unread?.count;
  const pass = (seconds: number): void => {
    for (let i = 0; i < seconds; i++) {
      FakeSocket.last.speak(status());
      vi.advanceTimersByTime(1_000);
    }
  };
  FakeSocket.last.onmessage?.({ data: 'null' });
  vi.advanceTimersByTime(500);
  FakeSocket.last.onopen?.();
  pass(50);
  expect(unread()).toBe(1);
  FakeSocket.last.onmessage?.({ data: 'null' });
  FakeSocket.last.onopen?.();
  pass(59);
  expect(unread()).toBe(2);
  pass(1);
  expect(unread()).toBeUndefined();
});

describe('a machine that slept for an hour', () => {
  const HOUR = 3_600_000;
  // A new stamp per test: a repeated state keeps its age.
  let sec = 100_000;
  const age = (): number | null => {
    const { snapshot } = selectShown(store.get());
    return ageSeconds(snapshot?.tags[0]?.scannedAt ?? null, shownTime(store.get(), now()));
  };
  const wake = (): void => {
    // The wall clock went on, the monotonic one stood still.
    vi.setSystemTime(Date.now() + HOUR);
    now();
  };
  const scannedAt = (at: number): ReturnType<typeof wireTag> =>
    wireTag({ readings: readings({ co2: 1 }, at) });

  beforeEach(() => {
    stop();
    sec += 10_000;
    vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout', 'performance', 'Date'] });
    stop = started(startLive);
    FakeSocket.last.onopen?.();
    FakeSocket.last.speak(status());
    FakeSocket.last.speak(stateFrame([scannedAt(sec - 5)], { sec }));
    expect(store.get().twin.phase).toBe('live');
    expect(age()).toBe(5);
  });

  test('shows no age and no “Live” before a fresh state has come', () => {
    const before = FakeSocket.count;
    wake();
    expect(age()).toBeNull();
    expect(store.get().twin.phase).toBe('reconnecting');
    expect(FakeSocket.count).toBe(before + 1);
    FakeSocket.last.onopen?.();
    expect([age(), store.get().twin.phase]).toEqual([null, 'reconnecting']);
    FakeSocket.last.speak(status());
    expect([age(), store.get().twin.phase]).toEqual([null, 'reconnecting']);
    FakeSocket.last.speak(stateFrame([scannedAt(sec - 5)], { sec: sec + 3_600 }));
    expect([age(), store.get().twin.phase]).toEqual([3_605, 'live']);
  });

  test('does not make the old state of a twin that is gone younger', () => {
    wake();
    FakeSocket.last.onopen?.();
    FakeSocket.last.speak(status({ twin: 'offline', reason: 'stale', state_age_seconds: 3_600 }));
    FakeSocket.last.speak(stateFrame([scannedAt(sec - 5)], { sec }));
    expect(age()).toBe(3_605);
    expect(store.get().twin.phase).toBe('offline');
  });

  test('takes nothing that came before it slept and was not shown yet', () => {
    FakeSocket.last.speak(
      stateFrame([scannedAt(sec - 5)], { seq: 2, sec: sec + 1, revision: 'waits' }),
    );
    expect(revision()).not.toBe('waits');
    vi.setSystemTime(Date.now() + HOUR);
    // Its own timer is the first to read the clock.
    vi.advanceTimersByTime(300);
    expect(revision()).not.toBe('waits');
    expect(age()).toBeNull();
  });
});

test('a state is taken once its connection has said how old it is', () => {
  FakeSocket.last.speak(stateFrame([wireTag()], { sec: 77, revision: 'unsaid' }));
  vi.advanceTimersByTime(2_000);
  expect(revision()).not.toBe('unsaid');
  FakeSocket.last.speak(status({ state_age_seconds: 12 }));
  expect(revision()).toBe('unsaid');
  const { snapshot } = selectShown(store.get());
  expect(now() - (snapshot?.takenAt ?? 0)).toBeCloseTo(14_000, -1);
});
