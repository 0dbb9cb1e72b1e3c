/**
 * Fetches what charts show. Nothing is fetched because of a frame: those bring their readings
 * themselves. Now and then, and after a reconnect, the server is asked anew.
 */
import { Refusal } from '../contract/api';
import { fetchTimeline } from '../contract/past';
import { fetchSeries } from '../contract/series';
import type { TwinTagState } from '../contract/types';
import type { Span } from '../domain/period';
import { laterBy, marksOf, seriesOf, type Series } from '../domain/series';
import { createStore } from '../store/create';
import { createFetcher } from '../store/fetcher';
import {
  NOTHING_FED,
  pairKey,
  withFetched,
  withOnly,
  withState,
  type Fed,
  type Fetched,
  type Pair,
} from './fed';

export interface Wanted {
  readonly pairs: readonly Pair[];
  readonly span: Span;
  /** The twin's time, ROS seconds: the span may end later. */
  readonly nowS: number;
  /** What the span is called: one that moves with the time keeps its name. */
  readonly period: string;
  /** At most so many readings or buckets a line. */
  readonly points: number;
  /** How long a day takes, seconds, where the day before is wanted too; null: it is not. */
  readonly dayS: number | null;
  /** Changes with each connection, and so after each gap in what was heard. */
  readonly epoch: number;
}

const INTERVAL_MS = 400;
/** Looks and failures are marked to a few pixels. */
const MARK_POINTS = 200;

/** The server is asked anew after so many seconds: a short period sooner, more of it is new. */
export function askAgainS({ from, to }: Span): number {
  return Math.min(300, Math.max(30, (to - from) / 200));
}

export interface Feed {
  readonly get: () => Fed;
  readonly subscribe: (listener: () => void) => () => void;
  /** Null: nothing any more. */
  readonly want: (wanted: Wanted | null) => void;
  /** The tags of a new state of the twin. */
  readonly hear: (tags: readonly TwinTagState[]) => void;
}

export function createFeed(): Feed {
  const store = createStore<Fed, (fed: Fed) => Fed>(NOTHING_FED, (fed, change) => change(fed));
  let pairs: readonly Pair[] = [];
  let group = '';

  const fetcher = createFetcher<Fetched>({
    paceMs: INTERVAL_MS,
    onValue: (fetched) => {
      store.dispatch((fed) => withFetched(fed, fetched));
    },
    onError: (message, _, error) => {
      const isMissing = error instanceof Refusal && error.status === 404;
      store.dispatch((fed) => ({ ...fed, state: isMissing ? 'missing' : 'failed', message }));
    },
  });

  return {
    get: store.get,
    subscribe: store.subscribe,
    want: (wanted) => {
      if (!wanted) {
        fetcher.want(null);
        pairs = [];
        group = '';
        return;
      }
      ({ pairs } = wanted);
      const next = [wanted.period, wanted.points, wanted.dayS, ...pairs.map(pairKey)].join(
        '\u0001',
      );
      if (next !== group) {
        group = next;
        store.dispatch((fed) => withOnly(fed, wanted.pairs));
      }
      const turn = Math.floor(wanted.span.to / askAgainS(wanted.span));
      fetcher.want({
        key: `${group}\u0001${wanted.epoch}\u0001${turn}`,
        group,
        run: (signal) => fetchAll(wanted, signal),
      });
    },
    hear: (tags) => {
      store.dispatch((fed) => withState(fed, pairs, tags));
    },
  };
}

/** Null: it was before the twin's time began, as in a simulation. */
function dayBefore({ from, to }: Span, dayS: number): Span | null {
  return to > dayS ? { from: Math.max(0, from - dayS), to: to - dayS } : null;
}

async function fetchAll(
  { pairs, span, nowS, points, dayS }: Wanted,
  signal: AbortSignal,
): Promise<Fetched> {
  const tagIds = [...new Set(pairs.map(({ tagId }) => tagId))];
  const before = dayS === null ? null : dayBefore(span, dayS);
  const fetched = async ({ from, to }: Span): Promise<[string, Series][]> => {
    const all = pairs.map((pair) => fetchSeries({ ...pair, from, to, points }, signal));
    return (await Promise.all(all)).map((wire) => [
      pairKey({ tagId: wire.tag_id, sensor: wire.sensor_type }),
      seriesOf(wire, nowS),
    ]);
  };
  const [series, earlier, timelines] = await Promise.all([
    fetched(span),
    before === null ? [] : fetched(before),
    Promise.all(tagIds.map((tagId) => fetchTimeline(span, MARK_POINTS, signal, tagId))),
  ]);
  return {
    until: Math.min(span.to, nowS),
    series: new Map(series),
    before: new Map(earlier.map(([key, each]) => [key, laterBy(each, dayS ?? 0)])),
    marks: new Map(timelines.map((timeline, index) => [tagIds[index] ?? '', marksOf(timeline)])),
  };
}
