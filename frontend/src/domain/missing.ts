/** The parts of a period that an answer does not vouch for: nobody may take them for silence. */
import type { WireTime } from '../contract/types';
import type { Span } from './period';
import { secondsOf } from './rostime';

/** A stretch of which something may have been received that the answer does not have. */
export interface Missing extends Span {
  readonly why: 'not_kept' | 'not_recorded';
}

interface Told {
  readonly from: WireTime;
  readonly to: WireTime;
  readonly complete_to: WireTime | null;
  readonly kept_from: WireTime | null;
}

/** The twin says once a second how far its journal is. */
const SLACK_S = 5;

/** `nowS` is the twin's time at which it was told: of what comes later nothing is missing. */
export function missingOf(told: Told, nowS: number): readonly Missing[] {
  const [from, to] = [secondsOf(told.from), Math.min(secondsOf(told.to), nowS)];
  const missing: Missing[] = [];
  if (told.kept_from) missing.push({ from, to: secondsOf(told.kept_from), why: 'not_kept' });
  const complete = told.complete_to && secondsOf(told.complete_to);
  if (complete !== null && to - complete > SLACK_S) {
    missing.push({ from: Math.max(from, complete), to, why: 'not_recorded' });
  }
  return missing.filter((stretch) => stretch.to > stretch.from);
}
