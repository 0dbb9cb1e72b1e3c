/** What an alarm is about, as it is now: its value, how bad that is, and its trend. Pure. */
import type { Alarm, HealthReason, Verdict } from '../contract/types';
import type { When } from '../domain/time';
import { isOfRange, sideOf } from '../domain/health';
import { isOldReading, trendOf, type TagThen } from '../domain/difference';

export type Now =
  | {
      readonly kind: 'known';
      /** In the sensor's unit; null: it is derived, and in range. Of a pest how many were counted, null: none. */
      readonly value: number | null;
      /** How bad that is. */
      readonly verdict: Verdict;
      /** Why; null: it is in its range. */
      readonly reason: HealthReason | null;
      /** What it is less what it was an hour ago; null: not known, or the same reading. */
      readonly trend: number | null;
    }
  /** Too old, no reading, or the twin is silent. */
  | {
      readonly kind: 'unknown';
      readonly last: number | null;
      readonly lastAt: When;
    };

const unknown = (last: number | null, lastAt: When): Now => ({ kind: 'unknown', last, lastAt });

/**
 * `tag` and `hourAgo` are the alarm's tag as the bridge judged it last, and an hour before; null: not
 * known. `isLive`: false, and what was received last says nothing about now. Null: the alarm has no
 * value, or is resolved.
 */
export function nowOf(
  { reason, cleared_at: clearedAt }: Alarm,
  tag: TagThen | null,
  hourAgo: TagThen | null,
  isLive: boolean,
): Now | null {
  const { kind, sensor } = reason;
  const isPest = kind === 'pest';
  if (clearedAt !== null || !(isPest || kind === 'range' || kind === 'changed')) return null;
  if (!tag || (isPest && !isLive)) return unknown(null, 'unknown');
  const said = tag.health.reasons.find((each) => each.kind === kind && each.sensor === sensor);
  const verdict = said?.verdict ?? 'healthy';
  if (isPest) {
    const value = said ? (said.value ?? 0) : null;
    return { kind: 'known', value, verdict, reason: said ?? null, trend: null };
  }
  const { readings, readAt } = tag.tag;
  // What is derived has no reading: what there is of it stands in its reason.
  const isDerived = readings.size > 0 && !readings.has(sensor);
  const last = isDerived ? (said?.value ?? null) : (readings.get(sensor) ?? null);
  // Of what is within its range nothing is said, nor what it is.
  const lacks = ({ kind: why, verdict: how }: HealthReason): boolean =>
    how === 'unknown' || why === 'reading_failed';
  if (isLive && isDerived && !said && !tag.health.reasons.some(lacks)) {
    return { kind: 'known', value: null, verdict, reason: null, trend: null };
  }
  if (!isLive || last === null || isOldReading(sensor, tag)) {
    return unknown(last, readAt.get(sensor) ?? 'unknown');
  }
  const trend = trendOf(sensor, tag, hourAgo);
  return {
    kind: 'known',
    value: last,
    verdict,
    reason: said ?? null,
    trend: trend?.kind === 'by' ? trend.by : null,
  };
}

/** Why, as it is now, and how bad that is; as it was said last where nobody knows, or it has no value. */
export function reasonNow({ reason }: Alarm, now: Now | null): HealthReason {
  if (now?.kind !== 'known') return reason;
  return now.reason
    ? { ...now.reason, value: now.value ?? reason.value }
    : { ...reason, verdict: now.verdict };
}

/** Its worst value, never better than that of now, which may come first; null: there is none. */
export function worstOf({ reason, worst }: Alarm, now: Now | null): number | null {
  const known = worst ?? (isOfRange(reason) ? reason.value : null);
  const current = now?.kind === 'known' ? now.value : null;
  if (known === null || current === null) return known;
  const isBelow = isOfRange(reason) && sideOf(reason) === 'below';
  return isBelow ? Math.min(known, current) : Math.max(known, current);
}
