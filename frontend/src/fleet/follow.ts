/** The overview as the server sends it, over one socket that reconnects. */
import { epochOf, now, onLapse } from '../clock';
import { backoffMs } from '../connection/machine';
import { signInIfRequired } from '../connection/socket';
import { parseSites, withFrame, type Archive, type Sites } from './sites';

export interface Seen {
  readonly sites: Sites;
  /** null: nothing received yet. */
  readonly archive: Archive | null;
  /** When data stopped arriving, ms since the epoch; null: they arrive. */
  readonly lostAt: number | null;
}

/** The server sends something at least every five seconds. */
const SILENT_MS = 12_000;

/** Calls back with the full state on each change; returns a stop function. */
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
    timer = setTimeout(() => lost(null), SILENT_MS);
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
      // The server is unreachable, or the session has ended.
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
  // After sleep, the socket may be dead.
  const stopLapse = onLapse(() => setTimeout(open));
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
