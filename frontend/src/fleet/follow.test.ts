import { afterEach, expect, test, vi } from 'vitest';

import { follow } from './follow';

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
});

test('a connection that is refused may be one of a session that has ended', () => {
  vi.useFakeTimers();
  vi.stubGlobal('WebSocket', FakeSocket);
  const requests: string[] = [];
  vi.stubGlobal('fetch', (url: URL) => {
    requests.push(url.pathname);
    return Promise.resolve(new Response());
  });
  const stop = follow('ws://test/ws/sites', () => undefined);
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
