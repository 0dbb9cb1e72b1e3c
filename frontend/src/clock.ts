/** The page's one clock: when something came, and how long ago that is. */

/** ms on the browser's monotonic clock: for differences, never for a time of day. */
export const now = (): number => performance.now();

/** Time of day on the operator's own clock, ms since the epoch. */
export const timeOfDay = (): number => Date.now();

/** Time of day, ms since the epoch, of a moment on the monotonic clock. */
export function epochOf(moment: number): number {
  return timeOfDay() - (now() - moment);
}
