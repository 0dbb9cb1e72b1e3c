/** The overview as the server sends it: one socket, tried again whenever it ends. */
import { epochOf, now, onLapse } from '../clock';
import { backoffMs } from '../connection/machine';
import { signInIfRequired } from '../connection/socket';
import { parseSites, withFrame, type Archive, type Sites } from './sites';

export interface Seen {
  readonly sites: Sites;
  /** null: nothing has come yet. */
  readonly archive: Archive | null;
  /** Since when nothing comes any more, ms since the epoch; null: it does. */
  readonly lostAt: number | null;
}

/** The server sends something every five seconds at least. */
const SILENT_MS = 12_000;

/** Calls back with everything that is known, at each change; returns the way to stop. */
export function follow(url: string, onSeen: (seen: Seen) => void): () => void {
  let seen: Seen = { sites: new Map(), archive: null, lostAt: null };
  let socket: WebSocket | null = null;
  let failures = 0;
  let receivedAt = now();
  let timer: ReturnType<typeof setTimeout> | undefined;

  const update = (news: Partial<Seen>): void => {
    seen = { ...seen, ...news };
    onSeen(seen);
  };
  const drop = (): void => {
    clearTimeout(timer);
    if (!socket) return;
    socket.onmessage = socket.onclose = null;
    socket.close();
    socket = null;
  };
  const lost = (code: number | null): void => {
    drop();
    failures += 1;
    if (seen.lostAt === null) update({ lostAt: epochOf(receivedAt) });
    timer = setTimeout(open, backoffMs(failures, Math.random(), code));
  };
  const wait = (): void => {
    clearTimeout(timer);
    timer = setTimeout(() => {
      lost(null);
    }, SILENT_MS);
  };
  const open = (): void => {
    drop();
    let isOpened = false;
    socket = new WebSocket(url);
    socket.onopen = () => {
      isOpened = true;
    };
    socket.onclose = ({ code }) => {
      lost(code);
      // The server is away, or the session has ended.
      if (!isOpened) void signInIfRequired();
    };
    socket.onmessage = ({ data }) => {
      const frame = parseSites(data);
      if (!frame) return;
      receivedAt = now();
      failures = 0;
      wait();
      const isEmpty = !frame.is_whole && frame.sites.length === 0 && frame.gone.length === 0;
      const isSame = isEmpty && frame.archive.is_reachable === seen.archive?.is_reachable;
      if (isSame && seen.lostAt === null) return;
      update({ sites: withFrame(seen.sites, frame), archive: frame.archive, lostAt: null });
    };
    wait();
  };
  const again = (): void => {
    if (document.visibilityState === 'visible' && (seen.lostAt !== null || !socket)) open();
  };
  // Whoever slept may have a socket that nobody answers.
  const stopLapse = onLapse(() => {
    setTimeout(open);
  });
  document.addEventListener('visibilitychange', again);
  window.addEventListener('online', again);
  onSeen(seen);
  open();
  return () => {
    stopLapse();
    document.removeEventListener('visibilitychange', again);
    window.removeEventListener('online', again);
    drop();
  };
}
