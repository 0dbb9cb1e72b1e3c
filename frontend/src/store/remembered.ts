/** Keeps what is remembered of the period in view up to date, calmly. */
import { now } from '../clock';
import { fetchTimeline } from '../contract/past';
import { endsNow, type Period, type Span, spanOf } from '../domain/time';
import { type Timeline, timelineOf } from '../domain/timeline';
import { act, keepFetched, receive, store } from './app';
import { failed, NOTHING, ready } from './fetcher';
import { rosNow, selectLatest } from './moment';
import { DEFAULT_VIEW, SHORT_PERIOD } from './view';

/** Enough for the widest bar: a bucket is two or three pixels there. */
const BUCKETS = 240;
const INTERVAL_MS = 1_000;
/** What is new is looked for once a bucket, but not more and not less often than this, seconds. */
const SOONEST_S = 5;
const LATEST_S = 30;

/** The stretch to ask for: whole buckets, so that those that have passed stay as they are. */
export function requestedSpan(period: Period, nowS: number): Span | null {
  if (period.kind === 'all') return null;
  const span = spanOf(period, nowS, null);
  if (!endsNow(period)) return span;
  const bucketS = (span.to - span.from) / BUCKETS;
  const to = Math.ceil(span.to / bucketS) * bucketS;
  return { from: Math.max(0, to - (span.to - span.from)), to };
}

/** Which look at the period this is; another one may bring something new. */
export function turnOf(period: Period, nowS: number): number {
  if (period.kind === 'all') return Math.floor(nowS / LATEST_S);
  const { from, to } = spanOf(period, nowS, null);
  if (to < nowS) return 0;
  const bucketS = (to - from) / BUCKETS;
  return Math.floor(nowS / Math.min(LATEST_S, Math.max(SOONEST_S, bucketS)));
}

export function startRemembered(): () => void {
  let requested = '';
  let changes = 0;
  return keepFetched<Timeline>(
    {
      paceMs: INTERVAL_MS,
      everyMs: INTERVAL_MS,
      parts: (state) => [
        state.view.period,
        state.twin.connection.epoch,
        selectLatest(state).snapshot === null,
      ],
      onValue: (value) => {
        receive({ remembered: ready(value) });
      },
      onError: (message) => {
        receive({ remembered: failed(message, store.get().twin.remembered.value) });
      },
    },
    (state) => {
      const { epoch, socket, status } = state.twin.connection;
      const nowS = rosNow(state, now());
      if (socket.kind !== 'open' || status === null || nowS === null) {
        return undefined;
      }
      const { period } = state.view;
      const next = JSON.stringify(period);
      if (next !== requested) {
        requested = next;
        changes += 1;
        // What is known of another period is of no use.
        if (state.twin.remembered.value) receive({ remembered: NOTHING });
        // Which may have led back to the period before.
        if (store.get().view.period !== period) return undefined;
      }
      return {
        key: `${epoch}|${turnOf(period, nowS)}`,
        group: String(changes),
        run: (signal) =>
          fetchTimeline(requestedSpan(period, nowS), BUCKETS, signal).then((wire) =>
            timelineOf(wire, nowS),
          ),
      };
    },
  );
}

/** In a day's bar, memory that is shorter than this is squeezed into its right end, seconds. */
const SHORT_S = 10_800;
const HOUR_S = 3_600;

/** Whether the last hour tells more than the last day; a moment to show has to be in it. */
function isShort(reach: Span, moment: number | null): boolean {
  return reach.to - reach.from < SHORT_S && (moment === null || moment >= reach.to - HOUR_S);
}

/**
 * Decides on which period the page opens, where neither link nor person has chosen one: once, as soon as it is
 * known how far memory reaches. No period changes by itself later.
 */
export function startOpening(): () => void {
  let opensShort: boolean | null = null;
  const update = (): void => {
    const { twin, view } = store.get();
    const reach = twin.remembered.value?.reach;
    if (reach) opensShort ??= isShort(reach, view.moment);
    if (opensShort && view.period === DEFAULT_VIEW.period) {
      act({ period: SHORT_PERIOD });
    }
  };
  update();
  return store.subscribe(update);
}
