import { afterEach, beforeEach, expect, test, vi } from 'vitest';

import type { Frame } from '../contract/types';
import { status } from '../testing/page';
import { stateFrame, wireTag } from '../testing/tags';
import { store } from './app';
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
  stop = startLive();
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
  const unhear = store.subscribe(() => (changes += 1));
  for (let i = 0; i < 20; i++) {
    FakeSocket.last.speak(stateFrame([wireTag()], { seq: i, sec: 10 + i, revision: `r${i}` }));
    vi.advanceTimersByTime(100);
  }
  unhear();
  vi.advanceTimersByTime(300);
  expect(revision()).toBe('r19');
  expect(changes).toBeLessThanOrEqual(10);
  expect(changes).toBeGreaterThan(5);
});

test('deltas are put together; one that does not fit makes a new connection', () => {
  const header = { stamp: { sec: 50, nanosec: 0 }, frame_id: 'map' };
  const delta = { type: 'delta', revision: 'd', header, changed: [], removed: [] } as const;
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
  FakeSocket.last.onmessage?.({ data: 'null' });
  vi.advanceTimersByTime(50_000);
  expect(unread()).toBe(1);
  // Meanwhile there is a new connection.
  FakeSocket.last.onmessage?.({ data: 'null' });
  vi.advanceTimersByTime(50_000);
  expect(unread()).toBe(2);
  vi.advanceTimersByTime(10_000);
  expect(unread()).toBeUndefined();
});
