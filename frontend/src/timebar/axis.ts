/** Maps moments to positions on the time bar, and lays out its columns. Pure. */
import type { Span } from '../domain/time';
import type { Timeline } from '../domain/timeline';

/** The bar's time span, ROS seconds, and its width, CSS pixels. */
export interface Axis extends Span {
  readonly width: number;
}

/** A drag that ends within this distance of now snaps to now. */
const NOW_PX = 6;

export const xOf = ({ from, to, width }: Axis, at: number): number =>
  ((at - from) / (to - from)) * width;

export const momentAt = ({ from, to, width }: Axis, x: number): number =>
  from + (Math.min(width, Math.max(0, x)) / Math.max(1, width)) * (to - from);

export const pixelS = ({ from, to, width }: Axis): number => (to - from) / Math.max(1, width);

/**
 * The moment at a point of the bar; null: now. `now` is the twin's time, ROS seconds, and may lie
 * beyond the bar.
 */
export function chosenAt(axis: Axis, x: number, now: number): number | null {
  const at = momentAt(axis, x);
  const nowX = xOf(axis, now);
  return at >= now || (nowX <= axis.width + NOW_PX && x >= nowX - NOW_PX) ? null : at;
}

/** The moment one step on; null: now. A step never leaves the bar, except into now. */
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

/** The events within a few pixels. */
export type Column = ReturnType<typeof columnsOf>[number];

/**
 * Height as a share of the tallest. The square root, and at least 0.1, keep small counts visible.
 */
const height = (count: number, most: number): number =>
  count === 0 ? 0 : Math.max(0.1, Math.sqrt(count / most));

export function columnsOf({ buckets, bucket_s: bucketS }: Timeline, axis: Axis) {
  const all = buckets.filter(({ start }) => start < axis.to && start + bucketS > axis.from);
  const most = Math.max(1, ...all.map(({ scans, failures }) => Math.max(scans, failures)));
  return all.map((bucket) => {
    const x = xOf(axis, bucket.start);
    // Not beyond the end of the bar, which is usually now.
    const end = Math.min(bucket.start + bucketS, axis.to);
    return {
      ...bucket,
      end,
      x,
      width: Math.max(1, xOf(axis, end) - x),
      // Shares of the tallest column, 0 to 1.
      scanHeight: height(bucket.scans, most),
      failureHeight: height(bucket.failures, most),
    };
  });
}

/** Spans clipped to the bar, CSS pixels; at least one pixel wide. */
export function stretchesOf(spans: readonly Span[], axis: Axis) {
  return spans
    .filter(({ from, to }) => to > axis.from && from < axis.to)
    .map(({ from, to }) => {
      const x = Math.max(0, xOf(axis, from));
      return { x, width: Math.max(1, Math.min(axis.width, xOf(axis, to)) - x) };
    });
}

/** Start of each run of the clock except the first, CSS pixels. */
export function runStarts({ runs }: Pick<Timeline, 'runs'>, axis: Axis): readonly number[] {
  const first = Math.min(...runs.map(({ from }) => from));
  return runs
    .filter(({ from }) => from > first && from > axis.from && from < axis.to)
    .map(({ from }) => xOf(axis, from));
}

export const columnAt = (columns: readonly Column[], x: number): Column | undefined =>
  columns.find((column) => x >= column.x && x < column.x + column.width);
