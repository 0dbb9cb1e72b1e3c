/** The page's one connection, and what its frames do to the store. */
import { now, onLapse } from '../clock';
import { latestAfter } from '../contract/frames';
import { connect, type Link, signInIfRequired } from '../connection/socket';
import { stateSocketUrl } from '../contract/api';
import type { Latest } from '../contract/types';
import { receive } from './app';
import { withConnection, withState, withUnread } from './twin';
import { robotFrame } from './create';

/**
 * Frames come up to ten times a second; the page takes the newest four times a second at most.
 * More could not be read, and would cost a tablet its battery. A table of hundreds takes a frame's
 * time to lay out, so a large house is shown once a second.
 */
export function pauseMs(tags: number): number {
  return tags > 150 ? 1_000 : 250;
}

/** A message that could not be read is told of for so long after the last one. */
const REPORT_MS = 60_000;

let current: Link | null = null;

/** Does not wait for the back-off any longer. */
export function retryConnection(): void {
  current?.dispatch('wake');
}

export function startLive(): () => void {
  let latest: Latest | null = null;
  let arrivedAt = 0;
  let isNew = false;
  let takenAt = -Infinity;
  let timer: ReturnType<typeof setTimeout> | undefined;
  let forget: ReturnType<typeof setTimeout> | undefined;
  /** The connection that `latest` came on, and the last one whose first state was taken. */
  let receivedOn = -1;
  let greeted = -1;

  const take = (stateAgeSeconds: number | null): void => {
    clearTimeout(timer);
    timer = undefined;
    // First, for it may find that time has lapsed: what waits here is then of no known age.
    const at = now();
    if (!latest || !isNew) return;
    isNew = false;
    takenAt = at;
    try {
      receive(withState(latest, arrivedAt, stateAgeSeconds));
    } catch (error) {
      // The check of frames let something through: the page goes on with what it has.
      reportBad(String(error));
      link.dispatch('broken');
    }
  };

  const reportBad = (why: string): void => {
    receive(withUnread(why));
    clearTimeout(forget);
    forget = setTimeout(() => {
      receive({ unread: null });
    }, REPORT_MS);
  };

  const link = connect(stateSocketUrl(), {
    onConnection: (connection) => {
      receive(withConnection(connection, now()));
    },
    onRefused: () => void signInIfRequired(),
    onBad: reportBad,
    onFrame: (frame, connection) => {
      const { epoch, status } = connection;
      if (frame.type === 'alarms') {
        // As it is: alarms change seldom, and nobody is to wait for them.
        receive({ alarms: frame });
        return;
      }
      if (frame.type === 'robot') {
        robotFrame.set(frame);
        return;
      }
      if (frame.type !== 'status') {
        const at = now();
        const next = latestAfter(receivedOn === epoch ? latest : null, frame);
        if (!next) {
          link.dispatch('broken');
          return;
        }
        latest = next;
        receivedOn = epoch;
        isNew = true;
        arrivedAt = at;
      }
      if (!latest || receivedOn !== epoch || !status) return;
      if (greeted !== epoch) {
        // The first state may be an old one that the bridge kept; its status says how old.
        greeted = epoch;
        take(status.state_age_seconds);
        return;
      }
      if (frame.type === 'status') return;
      const pause = pauseMs(latest.state.tags.length) - (arrivedAt - takenAt);
      if (pause <= 0) take(null);
      else timer ??= setTimeout(take, pause, null);
    },
  });
  current = link;
  const unsubscribe = onLapse(() => {
    latest = null;
    isNew = false;
    receive({ isTimeLost: true });
    link.dispatch('start');
  });
  return () => {
    unsubscribe();
    clearTimeout(timer);
    clearTimeout(forget);
    link.stop();
    current = null;
  };
}
