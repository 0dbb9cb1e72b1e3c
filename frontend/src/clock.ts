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
/** Hears `lapse` when time has lapsed. */
export const lapses = new EventTarget();

const offsetNow = (): number => Date.now() - performance.now();
/** The present period without a lapse: its beginning, and the wall clock minus the monotonic one. */
let era = { from: -Infinity, offset: offsetNow() };
/** All periods, the latest first, for the time of day of earlier moments. */
const eras = [era];

/**
 * ms on the monotonic clock: for differences, never for a time of day. Each call checks for a lapse and
 * notifies listeners before it returns: do not call it while React renders.
 */
export function now(): number {
  const at = performance.now();
  const offset = offsetNow();
  if (offset - era.offset > LAPSE_MS) {
    era = { from: at, offset };
    eras.unshift(era);
    lapses.dispatchEvent(new Event('lapse'));
  } else {
    // Slewed or set back: the newer offset is the better one.
    era.offset = offset;
  }
  return at;
}

/** Time of day, ms since the epoch, of a moment on the monotonic clock, as it was then. */
export function epochOf(moment: number): number {
  const then = eras.find(({ from }) => from <= moment) ?? era;
  const offset = offsetNow();
  // In the present period, the present offset, unless there is an undetected lapse.
  const isPresent = then === era && offset - era.offset <= LAPSE_MS;
  return moment + (isPresent ? offset : then.offset);
}

/** Time of day on the operator's own clock, ms since the epoch. */
export const timeOfDay = (): number => Date.now();

/** The operator's own time zone, such as "Europe/Amsterdam". */
export const timeZone = (): string => new Intl.DateTimeFormat().resolvedOptions().timeZone;

export const pause = (ms: number): Promise<void> =>
  new Promise((resolve) => setTimeout(resolve, ms));
