const FIRST_MS = 500;
const LONGEST_MS = 15_000;
/** Pause after the server said that it is full: it needs room more than we need haste. */
const CROWDED_MS = 10_000;

/** WebSocket close code 1013, "try again later": the server has too many clients. */
export const TRY_AGAIN_LATER = 1013;

/**
 * Pause before the next attempt: doubled at each failure up to 15 s, and then anything from half
 * of that to all of it, so that a hundred screens do not return to a restarted server at once.
 *
 * @param failures attempts failed in a row, from 1
 * @param random from 0 to 1
 */
export function backoffMs(failures: number, random: number, closeCode: number | null): number {
  const doubled = FIRST_MS * 2 ** Math.min(failures - 1, 10);
  const floor = closeCode === TRY_AGAIN_LATER ? CROWDED_MS : 0;
  return Math.max(floor, Math.min(LONGEST_MS, doubled)) * (0.5 + 0.5 * random);
}
