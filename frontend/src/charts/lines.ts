/** What charts show, fetched in one go: the lines, the same a day before, and the marks. */
import { fetchTimeline } from '../contract/past';
import { fetchSeries } from '../contract/series';
import type { Span } from '../domain/period';
import { laterBy, marksOf, seriesOf, type Mark, type Series } from '../domain/series';

/** One line of a chart. */
export interface Pair {
  readonly tagId: string;
  readonly sensor: string;
}

export const pairKey = ({ tagId, sensor }: Pair): string => `${sensor}\u0000${tagId}`;

/** By `pairKey`, and marks by tag, as the server told them. */
export interface Lines {
  readonly series: ReadonlyMap<string, Series>;
  /** A day later than it was; empty: nobody asked for it. */
  readonly before: ReadonlyMap<string, Series>;
  readonly marks: ReadonlyMap<string, readonly Mark[]>;
}

export const NO_LINES: Lines = { series: new Map(), before: new Map(), marks: new Map() };

export interface Question {
  readonly pairs: readonly Pair[];
  readonly span: Span;
  /** The twin's time, ROS seconds: the span may end later. */
  readonly nowS: number;
  /** At most so many readings or buckets a line. */
  readonly points: number;
  /** How long a day takes, seconds, where the day before is wanted too; null: it is not. */
  readonly dayS: number | null;
}

/** Looks and failures are marked to a few pixels. */
const MARK_POINTS = 200;

export async function fetchLines(
  { pairs, span, nowS, points, dayS }: Question,
  signal: AbortSignal,
): Promise<Lines> {
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
    series: new Map(series),
    before: new Map(earlier.map(([key, each]) => [key, laterBy(each, dayS ?? 0)])),
    marks: new Map(timelines.map((timeline, index) => [tagIds[index] ?? '', marksOf(timeline)])),
  };
}

/** Null: it was before the twin's time began, as in a simulation. */
function dayBefore({ from, to }: Span, dayS: number): Span | null {
  return to > dayS ? { from: Math.max(0, from - dayS), to: to - dayS } : null;
}
