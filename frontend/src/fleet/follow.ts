/** The overview as the server sends it, over one socket that reconnects. */
import { epochOf, lapses, now } from '../clock';
import { connect, type ConnectionHandlers, signInIfRequired } from '../connection/socket';
import { parseSites, withFrame, type Archive, type Sites, type SitesFrame } from './sites';

export interface Seen {
  readonly sites: Sites;
  /** null: nothing received yet. */
  readonly archive: Archive | null;
  /** When data stopped arriving, seconds since the epoch; null: they arrive. */
  readonly lostAt: number | null;
}

/** Calls back with the full state on each change. */
export function follow(url: string, onSeen: (seen: Seen) => void, signal: AbortSignal): void {
  let seen: Seen = { sites: new Map(), archive: null, lostAt: null };
  let receivedAt = now();
  const update = (news: Partial<Seen>): void => {
    seen = { ...seen, ...news };
    onSeen(seen);
  };
  update({});
  const handlers: ConnectionHandlers<SitesFrame> = {
    parse: parseSites,
    onConnection: ({ socket }) => {
      // Nothing is lost before anything came; after sleep or a silence, the attempt may take long to fail.
      const isLost = socket.kind === 'closed' || (socket.kind === 'opening' && seen.archive);
      if (isLost && seen.lostAt === null) update({ lostAt: epochOf(receivedAt) / 1000 });
    },
    onFrame: (frame) => {
      receivedAt = now();
      const isEmpty = !frame.is_whole && frame.sites.length === 0 && frame.gone.length === 0;
      const isSame = isEmpty && frame.archive.is_reachable === seen.archive?.is_reachable;
      if (isSame && seen.lostAt === null) return;
      update({ sites: withFrame(seen.sites, frame), archive: frame.archive, lostAt: null });
    },
    // The server is unreachable, or the session has ended.
    onRefused: () => void signInIfRequired(),
  };
  const link = connect(url, handlers, signal);
  // After sleep, the socket may be dead.
  lapses.addEventListener('lapse', () => link.dispatch('start'), { signal });
}
