/** A reading is drawn at full strength up to this age, in seconds... */
const FADE_FROM_S = 60;
/** ...and at its faintest from this age on. */
const FADE_TO_S = 1800;
const FAINTEST = 0.35;

/**
 * Seconds since a tag was observed: its age in the snapshot plus the time since then, both ends
 * by one monotonic clock. A difference to the wall clock would be wrong in simulation and on a
 * tablet whose clock is off.
 */
export function ageSeconds(
  staleSeconds: number | null,
  takenAt: number,
  now: number,
): number | null {
  return staleSeconds === null ? null : staleSeconds + Math.max(0, now - takenAt) / 1000;
}

/** How strongly to draw something of that age, 0.35 to 1, even in ratios of age; null: faintest. */
export function freshness(age: number | null): number {
  if (age === null) return FAINTEST;
  const share =
    Math.log(Math.max(age, FADE_FROM_S) / FADE_FROM_S) / Math.log(FADE_TO_S / FADE_FROM_S);
  return 1 - (1 - FAINTEST) * Math.min(1, share);
}
