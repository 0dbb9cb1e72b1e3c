/**
 * The page's one clock: when something came, and how long ago that is.
 *
 * The monotonic clock is right for differences, but on Linux it stands still while the machine
 * sleeps; the wall clock goes on, but may be set. Where the wall clock runs ahead of the other
 * from one look to the next, the machine has slept or its clock was set: nobody can tell which,
 * so all that came before is then of an age that is not known.
 */
export interface Clocks {
  /** ms; never goes back, may stand still while the machine sleeps. */
  readonly monotonic: () => number;
  /** ms since the epoch; may be set. */
  readonly wall: () => number;
}

/** The clocks may come apart by so much between two looks, ms; slewing stays far below. */
export const LAPSE_MS = 2_000;
/** Lapses that are remembered for the time of day of what came before them. */
const MOST_ERAS = 100;

/** A stretch without a lapse: from when on, and wall less monotonic clock in it. */
interface Era {
  readonly from: number;
  readonly offset: number;
}

export class PageClock {
  readonly #clocks: Clocks;
  readonly #listeners = new Set<() => void>();
  #last: number;
  #eras: readonly Era[];

  constructor(clocks: Clocks) {
    this.#clocks = clocks;
    this.#last = clocks.monotonic();
    this.#eras = [{ from: -Infinity, offset: clocks.wall() - this.#last }];
  }

  /**
   * ms on the monotonic clock: for differences, never for a time of day. Each call looks whether
   * time has lapsed, and tells of it before it returns: not to be called while React renders.
   */
  now(): number {
    const now = this.#clocks.monotonic();
    const offset = this.#clocks.wall() - now;
    const era = this.#eras.at(-1);
    const hasGoneBack = now < this.#last;
    this.#last = now;
    if (era && !hasGoneBack && offset - era.offset > LAPSE_MS) {
      this.#eras = [...this.#eras.slice(-MOST_ERAS), { from: now, offset }];
      for (const listener of [...this.#listeners]) listener();
      return now;
    }
    // Slewed, or set back: the newer word of the wall clock is the better one.
    const before = hasGoneBack ? [] : this.#eras.slice(0, -1);
    this.#eras = [...before, { from: before.length > 0 ? (era?.from ?? now) : -Infinity, offset }];
    return now;
  }

  /** Time of day, ms since the epoch, of a moment on the monotonic clock: as it was then. */
  epochOf(moment: number): number {
    const era = this.#eras.findLast(({ from }) => from <= moment) ?? this.#eras[0];
    const offset = this.#clocks.wall() - this.#clocks.monotonic();
    if (!era) return moment + offset;
    // Of the present stretch the present word, unless time has lapsed and nobody has looked yet.
    const isPresent = era === this.#eras.at(-1) && offset - era.offset <= LAPSE_MS;
    return moment + (isPresent ? offset : era.offset);
  }

  /** Calls back when time has lapsed; returns the way to stop. */
  onLapse(listener: () => void): () => void {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  }
}

const clock = new PageClock({
  monotonic: () => performance.now(),
  wall: () => Date.now(),
});

/** See `PageClock.now`. */
export const now = (): number => clock.now();

/** See `PageClock.epochOf`. */
export const epochOf = (moment: number): number => clock.epochOf(moment);

/** See `PageClock.onLapse`. */
export const onLapse = (listener: () => void): (() => void) => clock.onLapse(listener);

/** Time of day on the operator's own clock, ms since the epoch. */
export const timeOfDay = (): number => Date.now();

/** The operator's own time zone, such as "Europe/Amsterdam". */
export const timeZone = (): string => new Intl.DateTimeFormat().resolvedOptions().timeZone;

export const pause = (ms: number): Promise<void> =>
  new Promise((resolve) => {
    setTimeout(resolve, ms);
  });
