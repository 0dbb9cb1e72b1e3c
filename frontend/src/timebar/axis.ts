/** Where a moment lies on the bar, and what the bar shows where. Pure. */
import type { Span } from '../domain/time';
import type { Happened, Timeline } from '../domain/timeline';

/** The bar's stretch of time, ROS seconds, over its width in CSS pixels. */
export interface Axis extends Span {
  readonly width: number;
}

/** A drag to so few pixels from the right end of a period that ends now is a drag to now. */
const NOW_PX = 6;

export const xOf = ({ from, to, width }: Axis, at: number): number =>
  ((at - from) / (to - from)) * width;

export const momentAt = ({ from, to, width }: Axis, x: number): number =>
  from + (Math.min(width, Math.max(0, x)) / Math.max(1, width)) * (to - from);

export const pixelS = ({ from, to, width }: Axis): number => (to - from) / Math.max(1, width);

/**
 * The moment that a point of the bar stands for; null: now. `now` is the twin's time, which may
 * lie beyond the bar.
 */
export function chosenAt(axis: Axis, x: number, now: number): number | null {
  const at = momentAt(axis, x);
  const nowX = xOf(axis, now);
  return at >= now || (nowX <= axis.width + NOW_PX && x >= nowX - NOW_PX) ? null : at;
}

/** A step from where the bar stands; null: now. It never leaves the bar but into now. */
export function stepped(
  axis: Axis,
  from: number | null,
  seconds: number,
  now: number,
): number | null {
  const at = (from ?? Math.min(now, axis.to)) + seconds;
  if (at >= now) return null;
  return Math.max(Math.min(axis.from, from ?? axis.from), at);
}

/** CSS pixels; narrower columns cannot be told apart. */
const LEAST_COLUMN_PX = 3;

/** What happened within a few pixels. */
export type Column = ReturnType<typeof columnsOf>[number];

/**
 * A few scans beside many would vanish; by their root they stay in sight. The smallest is a tenth.
 */
const height = (count: number, most: number): number =>
  count === 0 ? 0 : Math.max(0.1, Math.sqrt(count / most));

export function columnsOf({ buckets, bucketS }: Timeline, axis: Axis) {
  const bucketPx = (bucketS / (axis.to - axis.from)) * axis.width;
  const together = Math.max(1, Math.ceil(LEAST_COLUMN_PX / Math.max(1e-9, bucketPx)));
  const wide = together * bucketS;
  const sums = new Map<number, Happened>();
  for (const bucket of buckets) {
    const place = Math.floor((bucket.start - axis.from) / wide + 1e-6);
    sums.set(place, added(sums.get(place), bucket, axis.from + place * wide));
  }
  const all = [...sums.values()].filter(({ start }) => start < axis.to && start + wide > axis.from);
  const most = Math.max(1, ...all.map(({ scans, failures }) => Math.max(scans, failures)));
  return all.map((sum) => {
    const x = xOf(axis, sum.start);
    // None beyond the end of the bar, which is mostly now.
    const end = Math.min(sum.start + wide, axis.to);
    return {
      ...sum,
      end,
      x,
      width: Math.max(1, xOf(axis, end) - x),
      // Of the tallest column, 0 to 1; any scan at all can be seen.
      scanHeight: height(sum.scans, most),
      failureHeight: height(sum.failures, most),
    };
  });
}

const added = (sum: Happened | undefined, bucket: Happened, start: number): Happened => ({
  start,
  scans: (sum?.scans ?? 0) + bucket.scans,
  failures: (sum?.failures ?? 0) + bucket.failures,
  looks: (sum?.looks ?? 0) + bucket.looks,
  pests_seen: (sum?.pests_seen ?? 0) + bucket.pests_seen,
  pests_cleared: (sum?.pests_cleared ?? 0) + bucket.pests_cleared,
});

/** The parts of spans that lie on the bar; what is less than a pixel is shown as one. */
export function stretchesOf(spans: readonly Span[], axis: Axis) {
  return spans
    .filter(({ from, to }) => to > axis.from && from < axis.to)
    .map(({ from, to }) => {
      const x = Math.max(0, xOf(axis, from));
      return { x, width: Math.max(1, Math.min(axis.width, xOf(axis, to)) - x) };
    });
}

/** Where a run of the clock begins that is not the first, in pixels. */
export function runStarts({ runs }: Timeline, axis: Axis): readonly number[] {
  const first = Math.min(...runs.map(({ from }) => from));
  return runs
    .filter(({ from }) => from > first && from > axis.from && from < axis.to)
    .map(({ from }) => xOf(axis, from));
}

export const columnAt = (columns: readonly Column[], x: number): Column | undefined =>
  columns.find((column) => x >= column.x && x < column.x + column.width);
