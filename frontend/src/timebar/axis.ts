/** Where a moment lies on the bar. Pure. */
import type { Span } from '../domain/period';

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

/** What a pixel is worth, seconds. */
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
