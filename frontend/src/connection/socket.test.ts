import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import { lapses } from '../clock';
import { parseFrame, statusOf } from '../contract/frames';
import type { Frame } from '../contract/types';
import { started } from '../testing/life';
import { status } from '../testing/page';
import { stateFrame } from '../testing/tags';
import { type Connection, type Phase, phaseOf, SILENCE_MS } from './machine';
import { connect, type ConnectionHandlers, type Link, signInIfRequired } from './socket';

class FakeSocket {
  static readonly made: FakeSocket[] = [];
  onopen: (() => void) | null = null;
  onclose: ((event: { code: number }) => void) | null = null;
  onmessage: ((event: { data: unknown }) => void) | null = null;
  closed = false;

  constructor(readonly url: string) {
    FakeSocket.made.push(this);
  }

  close(): void {
    this.closed = true;
  }

  speak(frame: Frame): void {
    this.onmessage?.({ data: JSON.stringify(frame) });
  }
}

let link: Link;
let stop: () => void;
let frames: Frame[];
let phases: Phase[];
let refusals: number;
let bad: string[];
const socket = (index: number): FakeSocket => {
  const made = FakeSocket.made.at(index);
  if (!made) throw new Error(`no socket ${index}`);
  return made;
};

beforeEach(() => {
  vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout', 'performance'] });
  vi.stubGlobal('WebSocket', FakeSocket);
  FakeSocket.made.length = 0;
  frames = [];
  phases = [];
  refusals = 0;
  bad = [];
  const handlers: ConnectionHandlers<Frame> = {
    parse: parseFrame,
    statusOf,
    onConnection: (connection: Connection) => {
      const phase = phaseOf(connection, performance.now());
      if (phases.at(-1) !== phase) phases.push(phase);
    },
    onFrame: (frame) => frames.push(frame),
    onBad: (why) => bad.push(why),
    onRefused: () => (refusals += 1),
  };
  stop = started((on) => (link = connect('ws://test/ws/state', handlers, on)));
});

afterEach(() => {
  stop();
  vi.useRealTimers();
});

describe('socket shell', () => {
  test('goes live, goes stale without a word, and reconnects by itself', () => {
    socket(0).onopen?.();
    socket(0).speak(status());
    socket(0).speak(stateFrame([]));
    expect(phases).toEqual(['connecting', 'live']);
    vi.advanceTimersByTime(SILENCE_MS + 10);
    expect(phases.at(-1)).toBe('stale');
    vi.advanceTimersByTime(30_000);
    expect(phases.at(-1)).toBe('reconnecting');
    expect(FakeSocket.made.length).toBeGreaterThan(1);
    expect(socket(0).closed).toBe(true);
  });

  test('only a socket that never opened was refused', () => {
    socket(0).onclose?.({ code: 1006 });
    expect(refusals).toBe(1);
    vi.advanceTimersByTime(30_000);
    socket(-1).onopen?.();
    socket(-1).onclose?.({ code: 1006 });
    expect(refusals).toBe(1);
  });

  test('frames of a dropped socket are ignored', () => {
    socket(0).onopen?.();
    vi.advanceTimersByTime(20_000);
    socket(0).speak(stateFrame([]));
    expect(frames).toEqual([]);
  });

  test.each(['online', 'pageshow'])('%s starts an attempt at once', (event) => {
    socket(0).onclose?.({ code: 1006 });
    expect(FakeSocket.made).toHaveLength(1);
    window.dispatchEvent(new Event(event));
    expect(FakeSocket.made).toHaveLength(2);
  });

  test('the tab becoming visible starts an attempt at once', () => {
    socket(0).onclose?.({ code: 1006 });
    document.dispatchEvent(new Event('visibilitychange'));
    expect(FakeSocket.made).toHaveLength(2);
  });

  test.each(['nonsense', new ArrayBuffer(2), '{"type":"state"}'])(
    'an invalid frame (%s) is reported, and a new connection brings the whole state at once',
    (data) => {
      socket(0).onopen?.();
      vi.advanceTimersByTime(5_000);
      socket(0).speak(status());
      socket(0).onmessage?.({ data });
      expect(bad).toHaveLength(1);
      expect(FakeSocket.made).toHaveLength(2);
      // If that breaks as well, with a pause: a server that only sends such frames has a rest.
      socket(1).onopen?.();
      socket(1).onmessage?.({ data });
      expect(FakeSocket.made).toHaveLength(2);
      vi.advanceTimersByTime(500);
      expect(FakeSocket.made).toHaveLength(3);
    },
  );

  test('a later server’s frame is passed over without a word', () => {
    socket(0).onopen?.();
    socket(0).onmessage?.({ data: '{"type":"weather"}' });
    expect([frames, bad]).toEqual([[], []]);
  });

  test('frames waiting in a socket after sleep are ignored: a new connection is made', () => {
    vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout', 'performance', 'Date'] });
    const unsubscribe = started((signal) => {
      lapses.addEventListener('lapse', () => link.dispatch('start'), { signal });
    });
    socket(0).onopen?.();
    socket(0).speak(status());
    socket(0).speak(stateFrame([]));
    vi.setSystemTime(Date.now() + 3_600_000);
    const { onmessage } = socket(0);
    onmessage?.({ data: JSON.stringify(stateFrame([], { seq: 2 })) });
    unsubscribe();
    expect(frames).toHaveLength(2);
    expect(phases).toEqual(['connecting', 'live', 'reconnecting']);
    expect(socket(0).closed).toBe(true);
    expect(FakeSocket.made).toHaveLength(2);
  });

  test('stopped is stopped', () => {
    stop();
    window.dispatchEvent(new Event('online'));
    vi.advanceTimersByTime(60_000);
    expect(FakeSocket.made).toHaveLength(1);
    expect(socket(0).closed).toBe(true);
  });
});

afterEach(() => {
  vi.unstubAllGlobals();
});

const answering = (status: number): void => {
  vi.stubGlobal('fetch', () => Promise.resolve(new Response(null, { status })));
};

test('a server that requires a token leads to its sign-in page, which says why', async () => {
  const leave = vi.fn<(url: URL) => void>();
  answering(401);
  await signInIfRequired(leave);
  location.hash = '#at=5&tag=7';
  await signInIfRequired(leave);
  location.hash = '';
  // A proxy that signs people in, as Authelia does.
  vi.stubGlobal('fetch', (_: URL, { redirect }: RequestInit) =>
    redirect === 'manual'
      ? Promise.resolve({ type: 'opaqueredirect', status: 0 })
      : Promise.reject(new TypeError('Failed to fetch')),
  );
  await signInIfRequired(leave);
  const left = leave.mock.calls.map(([url]) => url.pathname + url.hash);
  expect(left).toEqual(['/signin#ended', '/signin#ended&at=5&tag=7', '/signin#ended']);
});

test.each([200, 403, 503])('a server that answers %i keeps the page', async (status) => {
  const leave = vi.fn<(url: URL) => void>();
  answering(status);
  await signInIfRequired(leave);
  expect(leave).not.toHaveBeenCalled();
});

test('a server that is away keeps the page', async () => {
  const leave = vi.fn<(url: URL) => void>();
  vi.stubGlobal('fetch', () => Promise.reject(new TypeError('Failed to fetch')));
  await signInIfRequired(leave);
  expect(leave).not.toHaveBeenCalled();
});
