/** What the bridge's verdicts come to for the page. Nothing is judged here: no rule, no range. */
import type { HealthReason, Judgement, TagHealth, Verdict } from '../contract/types';
import type { Tag } from './twin';

/** From the worst to the best; of who is unknown, nobody knows that he is well. */
export const VERDICTS = [
  'critical',
  'stressed',
  'unknown',
  'healthy',
] as const satisfies readonly Verdict[];

/** Who was not judged, or not yet. */
const NOT_JUDGED: TagHealth = { verdict: 'unknown', reasons: [] };

export interface HouseHealth {
  readonly verdict: Verdict;
  readonly reasons: readonly HealthReason[];
  /** Whose ranges hold, and what says so; null: nobody was asked. */
  readonly day: Judgement['house']['day'] | null;
  /** What it is doing; null: nobody was asked. */
  readonly patrol: Judgement['house']['patrol'] | null;
  readonly counts: Readonly<Record<Verdict, number>>;
  readonly byTag: ReadonlyMap<string, TagHealth>;
}

const SILENT: HealthReason = {
  kind: 'silent',
  verdict: 'unknown',
  sensor: '',
  value: null,
  limit: null,
  since: null,
};

/**
 * The house as it was judged. `isHeard`: false, and nothing is known of it as a whole, whatever
 * was said last; of its tags that stands, with the age of their readings beside it.
 */
export function houseHealth(
  tags: readonly Tag[],
  judgement: Judgement | null,
  isHeard: boolean,
): HouseHealth {
  const counts = { critical: 0, stressed: 0, unknown: 0, healthy: 0 };
  const byTag = new Map<string, TagHealth>();
  for (const { id } of tags) {
    const health = judgement?.tags[id] ?? NOT_JUDGED;
    byTag.set(id, health);
    counts[health.verdict] += 1;
  }
  const { verdict, reasons } = isHeard ? (judgement?.house ?? NOT_JUDGED) : UNHEARD;
  return {
    verdict,
    reasons,
    day: judgement?.house.day ?? null,
    patrol: judgement?.house.patrol ?? null,
    counts,
    byTag,
  };
}

/** Whether something is known to be wrong. */
export const isBad = (verdict: Verdict): boolean =>
  verdict === 'critical' || verdict === 'stressed';

/** Whether nobody knows how it is now, of all its tags. */
export const isSilent = ({ reasons }: TagHealth): boolean => reasons[0]?.kind === 'silent';

const UNHEARD: TagHealth = { verdict: 'unknown', reasons: [SILENT] };

/**
 * The one order of what is wrong, of tags and of alarms; more is worse. By verdict, then what nobody
 * has seen to, then by how far beyond its limit the worst value is; of equals, by the tag.
 */
export function severity(health: TagHealth, isSeen = false): number {
  const reason = worstReason(health);
  const rank = VERDICTS.length - VERDICTS.indexOf(health.verdict);
  return 2 * rank - Number(isSeen) + (reason ? weight(reason) : 0);
}

/** What is to be said of a tag before all else. */
export const worstReason = ({ verdict, reasons }: TagHealth): HealthReason | undefined =>
  reasons.filter((reason) => reason.verdict === verdict).sort((a, b) => weight(b) - weight(a))[0];

/** Pests by their number; a value by how far it is beyond its limit, as a part of the larger of both. From 0 to 1. */
function weight(reason: HealthReason): number {
  if (reason.kind === 'pest') return 1 - 1 / (2 + (reason.value ?? 0));
  if (!isOfRange(reason) || reason.release !== undefined || reason.value === reason.limit) return 0;
  const { value, limit } = reason;
  return Math.min(0.99, Math.abs(value - limit) / Math.max(Math.abs(value), Math.abs(limit)));
}

/** Why a sensor's value counts as out of its range; null: it does not. */
export const rangeReason = (
  health: TagHealth | undefined,
  sensor: string,
): (HealthReason & { readonly value: number; readonly limit: number }) | null =>
  health?.reasons.filter(isOfRange).find((reason) => reason.sensor === sensor) ?? null;

export const isOfRange = (
  reason: HealthReason,
): reason is HealthReason & { readonly value: number; readonly limit: number } =>
  reason.kind === 'range' && reason.value !== null && reason.limit !== null;

/** On which side of its range a value is that lies outside, or has yet to pass `release`. */
export const sideOf = ({
  value,
  limit,
  release,
}: {
  readonly value: number;
  readonly limit: number;
  readonly release?: number | null;
}): 'below' | 'above' => (value < (release ?? limit) ? 'below' : 'above');

/** The very same as before where nothing else is said: what follows from it is kept then. */
export function sharedJudgement(before: Judgement | null, now: Judgement): Judgement {
  const isSame =
    before?.tags === now.tags && JSON.stringify(before.house) === JSON.stringify(now.house);
  return isSame ? before : now;
}
