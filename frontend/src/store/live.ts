/** The page's one connection, and what its frames do to the store. */
import { connect } from '../connection/socket';
import { stateSocketUrl } from '../contract/api';
import type { StateFrame } from '../contract/types';
import { receive } from './app';

/**
 * Frames come up to ten times a second; the page takes the newest four times a second at most.
 * More could not be read, and would cost a tablet its battery. A table of hundreds takes a frame's
 * time to lay out, so a large house is shown once a second.
 */
export function pauseMs(tags: number): number {
  return tags > 150 ? 1_000 : 250;
}

let retry: (() => void) | null = null;

/** Does not wait for the back-off any longer. */
export function retryConnection(): void {
  retry?.();
}

export function startLive(): () => void {
  let newest: { readonly frame: StateFrame; readonly now: number } | null = null;
  let takenAt = -Infinity;
  let timer: ReturnType<typeof setTimeout> | undefined;
  let greeted = -1;

  const take = (stateAgeSeconds: number | null): void => {
    clearTimeout(timer);
    timer = undefined;
    if (!newest) return;
    takenAt = performance.now();
    receive({ type: 'state', ...newest, stateAgeSeconds });
    newest = null;
  };

  const link = connect(stateSocketUrl(), {
    onConnection: (connection) => {
      receive({ type: 'connection', connection, now: performance.now() });
    },
    onFrame: (frame, connection) => {
      if (frame.type !== 'state') return;
      const now = performance.now();
      newest = { frame, now };
      if (connection.epoch !== greeted) {
        // The first state may be an old one that the bridge kept; its status says how old.
        greeted = connection.epoch;
        take(connection.status?.state_age_seconds ?? null);
        return;
      }
      const pause = pauseMs(frame.state.tags.length);
      if (now - takenAt >= pause) {
        take(null);
      } else {
        timer ??= setTimeout(take, pause - (now - takenAt), null);
      }
    },
  });
  retry = link.retry;
  return () => {
    clearTimeout(timer);
    link.stop();
    retry = null;
  };
}
