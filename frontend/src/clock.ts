/**
 * The page's one clock: when something arrived, and how long ago.
 *
 * The monotonic clock is right for differences, but on Linux it stands still while the machine
 * sleeps; the wall clock goes on, but may be set. If the wall clock gains on it between two readings,
 * the machine has slept or its clock was set. These cannot be distinguished, so the age of everything
 * before is then unknown.
 */

/** Tolerated drift between two readings, ms; slewing stays far below. */
const LAPSE_MS = 2_000;
/** Lapses remembered, for the time of day of earlier moments. */
const MOST_ERAS = 100;

/** Hears `lapse` when time has lapsed. */
export const lapses = new EventTarget();
/** The last monotonic reading. */
let last = performance.now();
/** Periods without a lapse: their beginning, and the wall clock minus the monotonic one. */
let eras: readonly { readonly from: number; readonly offset: number }[] = [
  { from: -Infinity, offset: Date.now() - last },
];

/**
 * ms on the monotonic clock: for differences, never for a time of day. Each call checks for a lapse and
 * notifies listeners before it returns: do not call it while React renders.
 */
export function now(): number {
  const at = performance.now();
  const offset = Date.now() - at;
  const era = eras.at(-1);
  const hasGoneBack = at < last;
  last = at;
  if (era && !hasGoneBack && offset - era.offset > LAPSE_MS) {
    eras = [...eras.slice(-MOST_ERAS), { from: at, offset }];
    lapses.dispatchEvent(new Event('lapse'));
    return at;
  }
  // Slewed or set back: the newer offset is the better one.
  const before = hasGoneBack ? [] : eras.slice(0, -1);
  eras = [...before, { from: before.length > 0 ? (era?.from ?? at) : -Infinity, offset }];
  return at;
}

/** Time of day, ms since the epoch, of a moment on the monotonic clock, as it was then. */
export function epochOf(moment: number): number {
  const era = eras.findLast(({ from }) => from <= moment) ?? eras[0];
  const offset = Date.now() - performance.now();
  if (!era) return moment + offset;
  // In the present period, the present offset, unless there is an undetected lapse.
  const isPresent = era === eras.at(-1) && offset - era.offset <= LAPSE_MS;
  return moment + (isPresent ? offset : era.offset);
}

/** Time of day on the operator's own clock, ms since the epoch. */
export const timeOfDay = (): number => Date.now();

/** The operator's own time zone, such as "Europe/Amsterdam". */
export const timeZone = (): string => new Intl.DateTimeFormat().resolvedOptions().timeZone;

export const pause = (ms: number): Promise<void> =>
  new Promise((resolve) => setTimeout(resolve, ms));
