import { now } from '../clock';
import { route } from '../contract/api';
import type { StatusFrame } from '../contract/types';
import {
  type Connection,
  type ConnectionEvent,
  INITIAL,
  nextDeadline,
  type Plain,
  step,
} from './machine';

export interface ConnectionHandlers<Frame> {
  /** Throws if a message violates the contract; null: its type is from a later server. */
  readonly parse: (data: unknown) => Frame | null;
  /** Null for a state frame; undefined for one that only shows that the server is alive. */
  readonly statusOf?: (frame: Frame) => StatusFrame | null | undefined;
  /** The connection changed, or a deadline passed and its phase may have changed. */
  readonly onConnection: (connection: Connection) => void;
  readonly onFrame: (frame: Frame, connection: Connection) => void;
  /** A message that violates the contract was dropped; `why` says how. */
  readonly onBad?: (why: string) => void;
  /** A socket closed without opening: the server is down, or requires sign-in. */
  readonly onRefused: () => void;
}

export type Link = ReturnType<typeof connect>;

/** Runs `machine.ts` with one socket, one timer and the browser's wake-up events. */
export function connect<Frame>(
  url: string,
  handlers: ConnectionHandlers<Frame>,
  signal: AbortSignal,
) {
  let connection = INITIAL;
  let socket: WebSocket | null = null;
  let timer: ReturnType<typeof setTimeout> | undefined;

  const send = (event: ConnectionEvent): void => {
    const { connection: next, command } = step(connection, event, Math.random());
    connection = next;
    if (command !== null) drop();
    if (command === 'reopen') open();
    clearTimeout(timer);
    const wait = Math.max(0, nextDeadline(connection, event.now) - event.now);
    timer = setTimeout(dispatch, wait, 'tick');
    handlers.onConnection(connection);
  };

  const dispatch = (type: Plain): void => send({ type, now: now() });

  // Remove the handlers before closing, so that a dropped socket delivers nothing more.
  const drop = (): void => {
    if (!socket) return;
    socket.onopen = socket.onmessage = socket.onclose = null;
    socket.close();
    socket = null;
  };

  const open = (): void => {
    let isOpened = false;
    const own = new WebSocket(url);
    socket = own;
    // Reading the clock may detect a lapse, which replaces this very socket.
    const look = (): number | null => {
      const at = now();
      return socket === own ? at : null;
    };
    own.onopen = () => {
      const at = look();
      if (at === null) return;
      isOpened = true;
      send({ type: 'opened', now: at });
    };
    own.onclose = ({ code }) => {
      if (look() === null) return;
      socket = null;
      send({ type: 'closed', now: now(), code });
      if (!isOpened) handlers.onRefused();
    };
    own.onmessage = ({ data }) => {
      const at = look();
      if (at === null) return;
      let frame;
      try {
        frame = handlers.parse(data);
      } catch (error) {
        // It may have been a delta.
        handlers.onBad?.(String(error));
        send({ type: 'broken', now: at });
        return;
      }
      if (frame === null) return;
      send({ type: 'frame', now: at, status: handlers.statusOf?.(frame) });
      if (look() === null) return;
      handlers.onFrame(frame, connection);
    };
  };

  const wake = (): void => {
    if (document.visibilityState === 'visible') dispatch('wake');
  };
  document.addEventListener('visibilitychange', wake, { signal });
  window.addEventListener('online', () => dispatch('online'), { signal });
  window.addEventListener('pageshow', wake, { signal });
  signal.addEventListener('abort', () => {
    clearTimeout(timer);
    drop();
  });

  dispatch('start');
  return { dispatch };
}

/**
 * Goes to the sign-in page if the server requires a token. A refused WebSocket does not say why, so this
 * asks over HTTP; a server that is merely down changes nothing.
 */
export async function signInIfRequired(leave: (url: URL) => void = goTo): Promise<void> {
  // A proxy leads to its own sign-in page on another origin, which only the whole page can follow.
  const options = { cache: 'no-store', redirect: 'manual' } as const;
  const answer = await fetch(route('readyz'), options).catch(() => null);
  if (answer?.status !== 401 && answer?.type !== 'opaqueredirect') return;
  // The view in the fragment goes along, and comes back.
  leave(new URL(`#ended${location.hash.replace('#', '&')}`, route('signin')));
}

function goTo(url: URL): void {
  location.assign(url);
}
