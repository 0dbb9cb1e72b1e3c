/** Keeps the timeline of the period in view up to date, at a slow pace. */
import { now } from '../clock';
import { fetchTimeline } from '../contract/past';
import { endsNow, type Period, type Span, spanOf } from '../domain/time';
import { type Timeline, timelineOf } from '../domain/timeline';
import { act, keepFetched, receive, store } from './app';
import { PAGE } from './create';
import { failed, NOTHING, ready } from './fetcher';
import { rosNow, selectLatest } from './moment';
import { DEFAULT_VIEW, SHORT_PERIOD } from './view';

/** A bucket is three pixels wide on a phone, and a few more on the widest bar. */
const BUCKETS = 120;
const INTERVAL_MS = 1_000;
/** Refetched once per bucket, within these bounds, seconds. */
const SOONEST_S = 5;
const LATEST_S = 30;

/** The span to request: whole buckets, so that past ones stay the same, unless all begin with the history. */
export function requestedSpan(period: Period, nowS: number, oldest: number | null): Span | null {
  if (period.kind === 'all') return null;
  const span = spanOf(period, nowS, oldest);
  if (!endsNow(period) || span.from === oldest) return span;
  const bucketS = (span.to - span.from) / BUCKETS;
  const to = Math.ceil(span.to / bucketS) * bucketS;
  return { from: Math.max(0, to - (span.to - span.from)), to };
}

/** Number of the current refetch interval; a new number refetches. */
export function turnOf(period: Period, nowS: number): number {
  if (period.kind === 'all') return Math.floor(nowS / LATEST_S);
  const { from, to } = spanOf(period, nowS, null);
  if (to < nowS) return 0;
  const bucketS = (to - from) / BUCKETS;
  return Math.floor(nowS / Math.min(LATEST_S, Math.max(SOONEST_S, bucketS)));
}

export function startRemembered(signal = PAGE): void {
  let requested = '';
  let changes = 0;
  keepFetched<Timeline>(
    {
      paceMs: INTERVAL_MS,
      everyMs: INTERVAL_MS,
      parts: (state) => [
        state.view.period,
        state.twin.connection.epoch,
        selectLatest(state).snapshot === null,
      ],
      onValue: (value) => receive({ remembered: ready(value) }),
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
        // The timeline of another period is of no use.
        if (state.twin.remembered.value) receive({ remembered: NOTHING });
        // That may have restored the previous period.
        if (store.get().view.period !== period) return undefined;
      }
      const oldest = store.get().twin.remembered.value?.reach?.from ?? null;
      return {
        key: `${epoch}|${turnOf(period, nowS)}|${requestedSpan(period, nowS, oldest)?.from === oldest}`,
        group: String(changes),
        run: (on) =>
          fetchTimeline(requestedSpan(period, nowS, oldest), BUCKETS, on).then((wire) =>
            timelineOf(wire, nowS),
          ),
      };
    },
    signal,
  );
}

/** A day's bar would squeeze a shorter history into its right end, seconds. */
const SHORT_S = 10_800;
const HOUR_S = 3_600;

/** Whether the last hour shows more than the last day; it must contain the requested moment. */
function isShort(reach: Span, moment: number | null): boolean {
  return reach.to - reach.from < SHORT_S && (moment === null || moment >= reach.to - HOUR_S);
}

/**
 * Chooses the period that the page opens on, if neither link nor user has chosen one: once, when the
 * length of the history is known. Later no period changes by itself.
 */
export function startOpening(signal = PAGE): void {
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
  store.subscribe(update, signal);
}
