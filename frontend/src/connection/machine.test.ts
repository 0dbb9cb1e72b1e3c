import { describe, expect, test } from 'vitest';

import type { StatusFrame } from '../contract/types';
import { status as statusWith } from '../testing/page';
import {
  backoffMs,
  type Command,
  type Connection,
  type ConnectionEvent,
  DEAD_MS,
  INITIAL,
  nextDeadline,
  OPENING_MS,
  phaseOf,
  SILENCE_MS,
  step as stepBy,
  TRY_AGAIN_LATER,
} from './machine';

const status = (twin: StatusFrame['twin']): StatusFrame =>
  statusWith({ twin, reason: twin === 'live' ? 'live' : 'stale' });

const step = (connection: Connection, event: ConnectionEvent): ReturnType<typeof stepBy> =>
  stepBy(connection, event, 1);

/** Applies events in order. */
function run(...events: ConnectionEvent[]): { connection: Connection; commands: Command[] } {
  const commands: Command[] = [];
  const connection = events.reduce((current, event) => {
    const next = step(current, event);
    commands.push(next.command);
    return next.connection;
  }, INITIAL);
  return { connection, commands };
}

const started: ConnectionEvent[] = [
  { type: 'start', now: 0 },
  { type: 'opened', now: 20 },
  { type: 'frame', now: 24, status: status('live') },
  { type: 'frame', now: 25, status: null },
];
const live = run(...started).connection;
const alarms = (now: number): ConnectionEvent => ({ type: 'frame', now, status: undefined });
const closed = (now: number, code: number | null = 1006): ConnectionEvent => ({
  type: 'closed',
  now,
  code,
});

describe('phases', () => {
  test('alarms are a sign of life, and no state', () => {
    const waiting = run(...started.slice(0, 3), alarms(30)).connection;
    expect(phaseOf(waiting, 30)).toBe('connecting');
    const received = step(live, alarms(25 + SILENCE_MS - 1)).connection;
    expect(phaseOf(received, 25 + SILENCE_MS)).toBe('live');
    expect(phaseOf(live, 25 + SILENCE_MS)).toBe('stale');
    // The page was suspended: this frame may be old too.
    expect(step(live, alarms(25 + DEAD_MS)).command).toBe('reopen');
    expect(step(INITIAL, alarms(1)).connection).toBe(INITIAL);
  });

  test('connecting until the first frame, then live', () => {
    expect(phaseOf(INITIAL, 0)).toBe('connecting');
    expect(phaseOf(run(...started.slice(0, 1)).connection, 10)).toBe('connecting');
    expect(phaseOf(run(...started.slice(0, 2)).connection, 22)).toBe('connecting');
    expect(phaseOf(run(...started.slice(0, 3)).connection, 24)).toBe('connecting');
    expect(phaseOf(live, 30)).toBe('live');
  });

  test('three seconds without a frame are stale, and a frame heals it', () => {
    expect(phaseOf(live, 25 + SILENCE_MS - 1)).toBe('live');
    expect(phaseOf(live, 25 + SILENCE_MS)).toBe('stale');
    const again = step(live, { type: 'frame', now: 4_000, status: null }).connection;
    expect(phaseOf(again, 4_001)).toBe('live');
  });

  test('the bridge reports that the twin is gone, and that it is back', () => {
    const gone = step(live, { type: 'frame', now: 100, status: status('offline') }).connection;
    expect(phaseOf(gone, 101)).toBe('offline');
    const heartbeat = step(gone, { type: 'frame', now: 1_000, status: null }).connection;
    expect(phaseOf(heartbeat, 1_001)).toBe('offline');
    const back = step(heartbeat, { type: 'frame', now: 2_000, status: status('live') }).connection;
    expect(phaseOf(back, 2_001)).toBe('live');
  });

  test('lost is reconnecting, also while the next attempt opens', () => {
    const lost = step(live, closed(100)).connection;
    expect(phaseOf(lost, 101)).toBe('reconnecting');
    const opening = step(lost, { type: 'tick', now: 10_000 }).connection;
    expect(phaseOf(opening, 10_001)).toBe('reconnecting');
    const open = step(opening, { type: 'opened', now: 10_010 }).connection;
    expect(phaseOf(open, 10_011)).toBe('reconnecting');
  });

  test('a first attempt that fails is reconnecting', () => {
    const { connection } = run({ type: 'start', now: 0 }, closed(5));
    expect(phaseOf(connection, 6)).toBe('reconnecting');
  });

  test('after a reconnect the page is live with the first state, not before', () => {
    const again = [
      closed(100),
      { type: 'wake', now: 110 } as const,
      { type: 'opened', now: 120 } as const,
      { type: 'frame', now: 121, status: status('live') } as const,
    ].reduce((connection, event) => step(connection, event).connection, live);
    expect(phaseOf(again, 122)).toBe('reconnecting');
    const state = step(again, { type: 'frame', now: 123, status: null }).connection;
    expect(phaseOf(state, 124)).toBe('live');
  });

  test('an old word about the twin does not outlive its connection', () => {
    const { connection } = run(
      ...started,
      { type: 'frame', now: 30, status: status('offline') },
      closed(40),
      { type: 'tick', now: 9_999 },
      { type: 'opened', now: 10_000 },
      { type: 'frame', now: 10_001, status: null },
    );
    expect(phaseOf(connection, 10_002)).toBe('reconnecting');
    const statusEvent: ConnectionEvent = { type: 'frame', now: 10_003, status: status('live') };
    expect(phaseOf(step(connection, statusEvent).connection, 10_004)).toBe('live');
  });

  test('a state alone is not live: its status has its age', () => {
    const { connection } = run(...started.slice(0, 2), { type: 'frame', now: 24, status: null });
    expect(phaseOf(connection, 30)).toBe('connecting');
  });

  test('after a lapse nothing is live before a state has come anew', () => {
    const lapsed = step(live, { type: 'start', now: 100 });
    expect(lapsed.command).toBe('reopen');
    expect(phaseOf(lapsed.connection, 100)).toBe('reconnecting');
    const waiting = step(live, closed(50)).connection;
    expect(step(waiting, { type: 'start', now: 60 }).command).toBe('reopen');
  });

  test('a frame that waited for a page that stood still is not believed', () => {
    const frame = (now: number): ConnectionEvent => ({ type: 'frame', now, status: null });
    expect(step(live, frame(25 + DEAD_MS - 1)).command).toBeNull();
    const late = step(live, frame(25 + DEAD_MS));
    expect(late.command).toBe('reopen');
    expect(phaseOf(late.connection, 25 + DEAD_MS)).toBe('reconnecting');
  });
});

describe('attempts', () => {
  test('the next one waits for its back-off', () => {
    const lost = step(live, closed(100)).connection;
    expect(lost.socket).toEqual({ kind: 'closed', retryAt: 600 });
    expect(nextDeadline(lost, 100)).toBe(600);
    expect(step(lost, { type: 'tick', now: 599 }).command).toBeNull();
    expect(step(lost, { type: 'tick', now: 600 }).command).toBe('reopen');
  });

  test('failures in a row wait longer; a connection that held starts afresh', () => {
    let { connection } = run({ type: 'start', now: 0 }, closed(0));
    const pauses: number[] = [];
    for (let i = 0; i < 4; i++) {
      const at = nextDeadline(connection, 0);
      connection = step(connection, { type: 'tick', now: at }).connection;
      connection = step(connection, closed(at)).connection;
      pauses.push(nextDeadline(connection, at) - at);
    }
    expect(pauses).toEqual([1000, 2000, 4000, 8000]);

    connection = step(connection, { type: 'wake', now: 50_000 }).connection;
    connection = step(connection, { type: 'opened', now: 50_010 }).connection;
    connection = step(connection, closed(60_000)).connection;
    expect(connection.failures).toBe(1);
  });

  test('a server that accepts and hangs up at once is not hammered', () => {
    let { connection } = run({ type: 'start', now: 0 });
    for (let i = 0; i < 5; i++) {
      connection = step(connection, { type: 'opened', now: i }).connection;
      connection = step(connection, { type: 'frame', now: i, status: null }).connection;
      connection = step(connection, closed(i)).connection;
      connection = step(connection, { type: 'wake', now: i }).connection;
    }
    expect(connection.failures).toBe(5);
  });

  test('a network that returns starts an attempt anew that began without it', () => {
    const { connection } = run({ type: 'start', now: 0 });
    expect(step(connection, { type: 'wake', now: 5 }).command).toBeNull();
    expect(step(connection, { type: 'online', now: 5 }).command).toBe('reopen');
    expect(step(live, { type: 'online', now: 500 }).command).toBeNull();
    expect(step(step(live, closed(100)).connection, { type: 'online', now: 101 }).command).toBe(
      'reopen',
    );
  });

  test('waking up leaves a living connection alone, and replaces a silent one', () => {
    expect(step(live, { type: 'wake', now: 500 }).command).toBeNull();
    expect(step(live, { type: 'wake', now: 25 + SILENCE_MS }).command).toBe('reopen');
  });

  test('an attempt that hangs is given up', () => {
    const { connection } = run({ type: 'start', now: 0 });
    expect(nextDeadline(connection, 0)).toBe(OPENING_MS);
    const given = step(connection, { type: 'tick', now: OPENING_MS });
    expect(given.command).toBe('drop');
    expect(given.connection.failures).toBe(1);
  });

  test('a connection silent for long is dropped although nobody closed it', () => {
    expect(nextDeadline(live, 30)).toBe(25 + SILENCE_MS);
    expect(step(live, { type: 'tick', now: 25 + SILENCE_MS }).command).toBeNull();
    expect(nextDeadline(live, 25 + SILENCE_MS)).toBe(25 + DEAD_MS);
    expect(step(live, { type: 'tick', now: 25 + DEAD_MS }).command).toBe('drop');
  });

  test('a connection that sends what cannot be used is replaced', () => {
    const broken = step(live, { type: 'broken', now: 9_000 });
    expect(broken.command).toBe('reopen');
    expect(phaseOf(broken.connection, 9_001)).toBe('reconnecting');
    const atOnce = step(live, { type: 'broken', now: 100 });
    expect(atOnce.command).toBe('drop');
    expect(nextDeadline(atOnce.connection, 100)).toBe(600);
  });

  test('each connection is an epoch of its own', () => {
    expect(live.epoch).toBe(1);
    const second = step(step(live, closed(50)).connection, { type: 'wake', now: 60 }).connection;
    expect(step(second, { type: 'opened', now: 70 }).connection.epoch).toBe(2);
  });
});

test('doubles with each failure up to 15 s', () => {
  const longest = [1, 2, 3, 4, 5, 6, 50].map((failures) => backoffMs(failures, 1, null));
  expect(longest).toEqual([500, 1000, 2000, 4000, 8000, 15_000, 15_000]);
});

test('jitter spreads over the upper half', () => {
  expect(backoffMs(3, 0, null)).toBe(1000);
  expect(backoffMs(3, 0.5, null)).toBe(1500);
});

test('a full server is left alone longer', () => {
  expect(backoffMs(1, 0, TRY_AGAIN_LATER)).toBe(5000);
});
