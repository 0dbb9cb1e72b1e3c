import { afterEach, expect, test, vi } from 'vitest';

import { follow } from './follow';
import { started } from '../testing/life';

class FakeSocket {
  static last: FakeSocket | null = null;
  onopen: (() => void) | null = null;
  onclose: ((event: { code: number }) => void) | null = null;
  onmessage: ((event: { data: unknown }) => void) | null = null;

  constructor() {
    FakeSocket.last = this;
  }

  close(): void {
    // It sends nothing more.
  }
}

afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

test('a page that wakes after a silence says so at once, not when its next attempt has failed', () => {
  vi.useFakeTimers();
  vi.stubGlobal('WebSocket', FakeSocket);
  const lost: boolean[] = [];
  const stop = started((on) =>
    follow('ws://test/ws/sites', ({ lostAt }) => lost.push(lostAt !== null), on),
  );
  const archive = { is_reachable: true, message: '', since: null };
  const sites = { type: 'sites', is_whole: true, archive, sites: [], gone: [] };
  const receive = (): void => FakeSocket.last?.onmessage?.({ data: JSON.stringify(sites) });
  FakeSocket.last?.onopen?.();
  receive();
  expect(lost).toEqual([false, false]);
  vi.advanceTimersByTime(4_000);
  document.dispatchEvent(new Event('visibilitychange'));
  expect(lost.at(-1)).toBe(true);
  FakeSocket.last?.onopen?.();
  receive();
  expect(lost.at(-1)).toBe(false);
  stop();
});

test('a connection that is refused may be one of a session that has ended', () => {
  vi.useFakeTimers();
  vi.stubGlobal('WebSocket', FakeSocket);
  const requests: string[] = [];
  vi.stubGlobal('fetch', (url: URL) => {
    requests.push(url.pathname);
    return Promise.resolve(new Response());
  });
  const stop = started((on) => follow('ws://test/ws/sites', () => undefined, on));
  FakeSocket.last?.onopen?.();
  FakeSocket.last?.onclose?.({ code: 1006 });
  expect(requests).toEqual([]);
  // Reconnects after a random pause, and is closed before it counts as silent.
  const first = FakeSocket.last;
  while (FakeSocket.last === first) vi.advanceTimersByTime(100);
  FakeSocket.last?.onclose?.({ code: 1006 });
  expect(requests).toEqual(['/readyz']);
  stop();
});
