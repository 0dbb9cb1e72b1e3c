/**
 * The connection's state machine. Pure: time and randomness are arguments; sockets and timers live in
 * `socket.ts`.
 */
import type { StatusFrame } from '../contract/types';

/** No frame for this long: the page's data no longer counts as live. */
export const SILENCE_MS = 3_000;
/** No frame for this long: the connection is dead, even if the socket looks open. */
export const DEAD_MS = 8_000;
/** Timeout of an attempt to connect. */
export const OPENING_MS = 6_000;
/** A connection that lasted this long resets the back-off when it breaks. */
const PROVEN_MS = 5_000;

export type Phase = 'connecting' | 'live' | 'stale' | 'offline' | 'reconnecting';

type Socket =
  | { readonly kind: 'closed'; readonly retryAt: number }
  | { readonly kind: 'opening'; readonly since: number }
  | {
      readonly kind: 'open';
      readonly since: number;
      readonly lastFrameAt: number | null;
      /** A state was received on this connection; until then, the page's data is not live. */
      readonly hasState: boolean;
    };

export interface Connection {
  readonly socket: Socket;
  /** Increases with each opened connection; earlier fetched data is out of date. */
  readonly epoch: number;
  readonly failures: number;
  /** The last status received on this connection. */
  readonly status: StatusFrame | null;
}

/** All times are ms on the monotonic clock. */
export type ConnectionEvent =
  | { readonly type: Plain; readonly now: number }
  /** `status` is null for a state; undefined for a frame that only shows that the bridge is alive. */
  | {
      readonly type: 'frame';
      readonly now: number;
      readonly status: StatusFrame | null | undefined;
    }
  | { readonly type: 'closed'; readonly now: number; readonly code: number | null };

/**
 * - start: make a new connection in any state; after a lapse, the old one may deliver old frames
 * - broken: an unusable frame, or a delta that does not fit: later deltas would build on it
 * - wake: the tab became visible, or the operator wants to retry now
 * - online: the network is back; restart a running attempt, which began without it
 * - tick: a deadline of `nextDeadline` may have passed
 */
export type Plain = 'start' | 'opened' | 'broken' | 'wake' | 'online' | 'tick';

/** What `socket.ts` must do. "reopen": drop the socket, if any, and make a new one. */
export type Command = 'reopen' | 'drop' | null;

export const INITIAL: Connection = {
  socket: { kind: 'closed', retryAt: 0 },
  epoch: 0,
  failures: 0,
  status: null,
};

/** The next state after an event; `random` from 0 to 1. */
export function step(
  connection: Connection,
  event: ConnectionEvent,
  random: number,
): { readonly connection: Connection; readonly command: Command } {
  const { socket } = connection;
  const { now } = event;
  switch (event.type) {
    case 'start':
      return open(connection, now);
    case 'opened':
      return stay({
        ...connection,
        epoch: connection.epoch + 1,
        status: null,
        socket: { kind: 'open', since: now, lastFrameAt: null, hasState: false },
      });
    case 'frame': {
      if (socket.kind !== 'open') return stay(connection);
      // The page was suspended: the frame may be old.
      if (silence(socket, now) >= DEAD_MS) return open(connection, now);
      const { status } = event;
      return stay({
        ...connection,
        status: status ?? connection.status,
        socket: { ...socket, lastFrameAt: now, hasState: socket.hasState || status === null },
      });
    }
    case 'closed':
      if (socket.kind === 'closed') return stay(connection);
      return stay(fail(connection, now, event.code, random));
    case 'broken':
      if (socket.kind !== 'open') return stay(connection);
      // A new connection begins with the whole state: at once, unless the last one broke as well.
      return isProven(socket, now)
        ? open(connection, now)
        : stay(fail(connection, now, null, random), 'drop');
    case 'online':
      return socket.kind === 'opening'
        ? open(connection, now)
        : step(connection, { type: 'wake', now }, random);
    case 'wake':
      if (socket.kind === 'closed') return open(connection, now);
      // After sleep, a socket often looks open but is dead.
      return socket.kind === 'open' && silence(socket, now) >= SILENCE_MS
        ? open(connection, now)
        : stay(connection);
    case 'tick':
      if (socket.kind === 'closed') {
        return now >= socket.retryAt ? open(connection, now) : stay(connection);
      }
      if (
        socket.kind === 'opening'
          ? now - socket.since >= OPENING_MS
          : silence(socket, now) >= DEAD_MS
      ) {
        return stay(fail(connection, now, null, random), 'drop');
      }
      return stay(connection);
  }
}

const stay = (connection: Connection, command: Command = null) => ({ connection, command });

const open = (connection: Connection, now: number) =>
  stay({ ...connection, socket: { kind: 'opening', since: now } }, 'reopen');

function fail(
  connection: Connection,
  now: number,
  closeCode: number | null,
  random: number,
): Connection {
  const { socket } = connection;
  const failures = isProven(socket, now) ? 1 : connection.failures + 1;
  const retryAt = now + backoffMs(failures, random, closeCode);
  return { ...connection, failures, socket: { kind: 'closed', retryAt } };
}

const isProven = (socket: Socket, now: number): boolean =>
  socket.kind === 'open' && now - socket.since >= PROVEN_MS;

const silence = (socket: Socket & { kind: 'open' }, now: number): number =>
  now - (socket.lastFrameAt ?? socket.since);

export function nextDeadline({ socket }: Connection, now: number): number {
  switch (socket.kind) {
    case 'closed':
      return socket.retryAt;
    case 'opening':
      return socket.since + OPENING_MS;
    case 'open': {
      const last = socket.lastFrameAt ?? socket.since;
      return last + (now - last < SILENCE_MS ? SILENCE_MS : DEAD_MS);
    }
  }
}

export function phaseOf(connection: Connection, now: number): Phase {
  const { socket, status } = connection;
  if (socket.kind === 'open' && socket.lastFrameAt !== null) {
    if (silence(socket, now) >= SILENCE_MS) return 'stale';
    if (status?.twin === 'offline') return 'offline';
    // Live needs a status too: it tells the age of the first state.
    if (socket.hasState && status) return 'live';
  }
  const first = connection.epoch <= (socket.kind === 'open' ? 1 : 0) && connection.failures === 0;
  return first ? 'connecting' : 'reconnecting';
}

const FIRST_MS = 500;
const LONGEST_MS = 15_000;
/** Least pause before the random part, after the server said that it is full. */
const CROWDED_MS = 10_000;

/** WebSocket close code 1013, "try again later": the server has too many clients. */
export const TRY_AGAIN_LATER = 1013;

/**
 * Pause before the next attempt, ms: doubled with each failure up to 15 s. A random factor of 0.5 to 1
 * keeps a hundred screens from returning to a restarted server all at once. `failures` in a row, from
 * 1; `random` from 0 to 1.
 */
export function backoffMs(failures: number, random: number, closeCode: number | null): number {
  const doubled = FIRST_MS * 2 ** Math.min(failures - 1, 10);
  const floor = closeCode === TRY_AGAIN_LATER ? CROWDED_MS : 0;
  return Math.max(floor, Math.min(LONGEST_MS, doubled)) * (0.5 + 0.5 * random);
}
