/** The page's one connection, and how its frames change the store. */
import { lapses, now } from '../clock';
import { latestAfter, parseFrame, statusOf } from '../contract/frames';
import {
  connect,
  type ConnectionHandlers,
  type Link,
  signInIfRequired,
} from '../connection/socket';
import { stateSocketUrl } from '../contract/api';
import type { Frame, Latest } from '../contract/types';
import { receive } from './app';
import { withConnection, withState, withUnread } from './twin';
import { PAGE, robotFrame } from './create';

/**
 * Frames arrive up to ten times a second; the page takes the latest at most four times a second.
 * More would be unreadable and drain a tablet's battery. A table of hundreds of rows is slow to lay
 * out, so a large greenhouse updates once a second.
 */
export function pauseMs(tags: number): number {
  return tags > 150 ? 1_000 : 250;
}

/** How long an unreadable message is reported, ms. */
const REPORT_MS = 60_000;

let current: Link | null = null;

/** Reconnects without waiting for the back-off. */
export function retryConnection(): void {
  current?.dispatch('wake');
}

export function startLive(signal = PAGE): void {
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
    // First, as it may detect a lapse, after which the age of waiting frames is unknown.
    const at = now();
    if (!latest || !isNew) return;
    isNew = false;
    takenAt = at;
    try {
      receive(withState(latest, arrivedAt, stateAgeSeconds));
    } catch (error) {
      // Not a frame of the contract: the page keeps its state.
      reportBad(String(error));
      link.dispatch('broken');
    }
  };

  const reportBad = (why: string): void => {
    receive(withUnread(why));
    clearTimeout(forget);
    forget = setTimeout(() => receive({ unread: null }), REPORT_MS);
  };

  const handlers: ConnectionHandlers<Frame> = {
    parse: parseFrame,
    statusOf,
    onConnection: (connection) => receive(withConnection(connection, now())),
    onRefused: () => void signInIfRequired(),
    onBad: reportBad,
    onFrame: (frame, connection) => {
      const { epoch, status } = connection;
      if (frame.type === 'alarms') {
        // Not throttled: alarms change seldom and must show at once.
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
        // The first state may be an old one that the bridge cached; its status has its age.
        greeted = epoch;
        take(status.state_age_seconds);
        return;
      }
      if (frame.type === 'status') return;
      const pause = pauseMs(latest.state.tags.length) - (arrivedAt - takenAt);
      if (pause <= 0) take(null);
      else timer ??= setTimeout(take, pause, null);
    },
  };
  const link = connect(stateSocketUrl(), handlers, signal);
  current = link;
  const onLapse = (): void => {
    latest = null;
    isNew = false;
    receive({ isTimeLost: true });
    link.dispatch('start');
  };
  lapses.addEventListener('lapse', onLapse, { signal });
  signal.addEventListener('abort', () => {
    clearTimeout(timer);
    clearTimeout(forget);
    current = null;
  });
}
