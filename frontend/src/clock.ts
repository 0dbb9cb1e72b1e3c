/**
 * The page's one clock: when something came, and how long ago that is.
 *
 * The monotonic clock is right for differences, but on Linux it stands still while the machine
 * sleeps; the wall clock goes on, but may be set. Where the wall clock runs ahead of the other
 * from one look to the next, the machine has slept or its clock was set: nobody can tell which,
 * so all that came before is then of an age that is not known.
 */

/** The clocks may come apart by so much between two looks, ms; slewing stays far below. */
const LAPSE_MS = 2_000;
/** Lapses that are remembered for the time of day of what came before them. */
const MOST_ERAS = 100;

const listeners = new Set<() => void>();
/** Never goes back, may stand still while the machine sleeps. */
let last = performance.now();
/** Stretches without a lapse: from when on, and wall less monotonic clock in it. */
let eras: readonly { readonly from: number; readonly offset: number }[] = [
  { from: -Infinity, offset: Date.now() - last },
];

/**
 * ms on the monotonic clock: for differences, never for a time of day. Each call looks whether
 * time has lapsed, and tells of it before it returns: not to be called while React renders.
 */
export function now(): number {
  const at = performance.now();
  const offset = Date.now() - at;
  const era = eras.at(-1);
  const hasGoneBack = at < last;
  last = at;
  if (era && !hasGoneBack && offset - era.offset > LAPSE_MS) {
    eras = [...eras.slice(-MOST_ERAS), { from: at, offset }];
    for (const listener of [...listeners]) listener();
    return at;
  }
  // Slewed, or set back: the newer word of the wall clock is the better one.
  const before = hasGoneBack ? [] : eras.slice(0, -1);
  eras = [...before, { from: before.length > 0 ? (era?.from ?? at) : -Infinity, offset }];
  return at;
}

/** Time of day, ms since the epoch, of a moment on the monotonic clock: as it was then. */
export function epochOf(moment: number): number {
  const era = eras.findLast(({ from }) => from <= moment) ?? eras[0];
  const offset = Date.now() - performance.now();
  if (!era) return moment + offset;
  // Of the present stretch the present word, unless time has lapsed and nobody has looked yet.
  const isPresent = era === eras.at(-1) && offset - era.offset <= LAPSE_MS;
  return moment + (isPresent ? offset : era.offset);
}

/** Calls back when time has lapsed; returns the way to stop. */
export function onLapse(listener: () => void): () => void {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

/** Time of day on the operator's own clock, ms since the epoch. */
export const timeOfDay = (): number => Date.now();

/** The operator's own time zone, such as "Europe/Amsterdam". */
export const timeZone = (): string => new Intl.DateTimeFormat().resolvedOptions().timeZone;

export const pause = (ms: number): Promise<void> =>
  new Promise((resolve) => {
    setTimeout(resolve, ms);
  });
