/** Presents the bridge's verdicts. Nothing is judged here: no rule, no range. */
import type { HealthReason, Judgement, TagHealth, Verdict } from '../contract/types';
import { S } from '../strings';
import { ageText, beyondLimitText, readingText, valueText } from './format';
import { groupedBy, type Shared } from './memo';
import type { Catalogue, Sensor } from './sensors';
import { shown } from './text';
import type { Tag } from './twin';

/** From the worst to the best; "unknown" is worse than "healthy". */
export const VERDICTS = [
  'critical',
  'stressed',
  'unknown',
  'healthy',
] as const satisfies readonly Verdict[];

export const NOT_JUDGED: TagHealth = { verdict: 'unknown', reasons: [] };

export type HouseHealth = Shared<ReturnType<typeof houseHealth>>;

const SILENT: HealthReason = {
  kind: 'silent',
  verdict: 'unknown',
  sensor: '',
  value: null,
  limit: null,
  since: null,
};

/**
 * The greenhouse as judged. If `isReceiving` is false, its own verdict is unknown, whatever came last;
 * the tags' verdicts stay, beside the age of their readings. Without an age, that all was well says nothing.
 */
export function houseHealth(
  tags: readonly Tag[],
  judgement: Judgement | null,
  isReceiving: boolean,
  areAged = true,
) {
  const counts = { critical: 0, stressed: 0, unknown: 0, healthy: 0 };
  const byTag = new Map<string, TagHealth>();
  for (const { id, scannedAt } of tags) {
    const judged = judgement?.tags[id] ?? NOT_JUDGED;
    const isDated = isReceiving || (areAged && scannedAt !== 'unknown');
    const health = isDated || judged.verdict !== 'healthy' ? judged : NOT_JUDGED;
    byTag.set(id, health);
    counts[health.verdict] += 1;
  }
  const { verdict, reasons } = isReceiving ? (judgement?.house ?? NOT_JUDGED) : NOT_RECEIVED;
  return {
    verdict,
    reasons,
    /** Whether day or night ranges hold, and why; null: not judged. */
    day: judgement?.house.day ?? null,
    /** The robot's patrol; null: not judged. */
    patrol: judgement?.house.patrol ?? null,
    counts: counts as Readonly<Record<Verdict, number>>,
    byTag,
  };
}

export const isBad = (verdict: Verdict): boolean =>
  verdict === 'critical' || verdict === 'stressed';

/** Whether the greenhouse as a whole is silent. */
export const isSilent = ({ reasons }: TagHealth): boolean => reasons[0]?.kind === 'silent';

const NOT_RECEIVED: TagHealth = { verdict: 'unknown', reasons: [SILENT] };

/**
 * The one order of problems, for tags and alarms; higher is worse. By verdict, then unacknowledged
 * first, then by how far the worst value exceeds its limit; ties by tag.
 */
export function severity(health: TagHealth, isSeen = false): number {
  const reason = worstReason(health);
  const rank = VERDICTS.length - VERDICTS.indexOf(health.verdict);
  return 2 * rank - Number(isSeen) + (reason ? weight(reason) : 0);
}

/** The most important reason of a tag. */
export const worstReason = ({ verdict, reasons }: TagHealth): HealthReason | undefined =>
  reasons.filter((reason) => reason.verdict === verdict).sort((a, b) => weight(b) - weight(a))[0];

/** From 0 to 1: pests by number; a value by its distance to the limit, relative to the larger of both. */
function weight(reason: HealthReason): number {
  if (reason.kind === 'pest') return 1 - 1 / (2 + (reason.value ?? 0));
  if (!isOfRange(reason) || reason.release !== undefined || reason.value === reason.limit) return 0;
  const { value, limit } = reason;
  return Math.min(0.99, Math.abs(value - limit) / Math.max(Math.abs(value), Math.abs(limit)));
}

/** Why a sensor's value counts as out of range; null: it does not. */
export const rangeReason = (health: TagHealth | undefined, sensor: string): OfRange | null =>
  health?.reasons.filter(isOfRange).find((reason) => reason.sensor === sensor) ?? null;

type OfRange = HealthReason & { readonly value: number; readonly limit: number };

export const isOfRange = (reason: HealthReason): reason is OfRange =>
  reason.kind === 'range' && reason.value !== null && reason.limit !== null;

/** The side of its range on which a value lies that is outside, or has yet to pass `release`. */
export const sideOf = ({
  value,
  limit,
  release,
}: Pick<OfRange, 'value' | 'limit' | 'release'>): 'below' | 'above' =>
  value < (release ?? limit) ? 'below' : 'above';

/** On which side of their ranges these tell of damp air; all follow from the same two readings. */
const DAMP: Partial<Record<string, 'below' | 'above'>> = {
  humidity: 'above',
  vpd: 'below',
  condensation_margin: 'below',
};

/** Whether a reason tells of damp or dry air: of a tag, all such reasons have one cause. Null: neither. */
export function airOf(reason: HealthReason): 'damp' | 'dry' | null {
  const damp = isOfRange(reason) && DAMP[reason.sensor];
  return !damp ? null : sideOf(reason) === damp ? 'damp' : 'dry';
}

/** A tag's reasons by their cause, in the same order. */
export const byCause = (
  reasons: readonly HealthReason[],
): readonly (readonly [HealthReason, ...HealthReason[]])[] => [
  ...groupedBy(reasons, (reason) => airOf(reason) ?? `${reason.kind} ${reason.sensor}`).values(),
];

/** The previous object if the content is the same, so that derived values stay cached. */
export function sharedJudgement(before: Judgement | null, now: Judgement): Judgement {
  const isSame =
    before?.tags === now.tags && JSON.stringify(before.house) === JSON.stringify(now.house);
  return isSame ? before : now;
}

/** Longest name of an undeclared sensor or kind, characters. */
const LONGEST_NAME = 32;
/** A longer name gives way to its abbreviation, if it has one. */
const LONG_NAME = 19;

/** A sensor's name in sentences and headings. */
export const nameOf = ({ label }: Sensor): string =>
  shown(label.length > LONG_NAME ? S.sensorShort(label) : label, LONGEST_NAME);

/** Appends a critical or healthy verdict; no suffix means out of range. */
export const ratedText = (text: string, verdict: Verdict): string =>
  verdict === 'critical' || verdict === 'healthy' ? `${text} (${S.alarmStatus[verdict]})` : text;

/**
 * A reason as a sentence without its full stop. `age` is that of the observation behind it, seconds;
 * null: it is recent, shown elsewhere, or not known. `isMarked`: a sign beside it shows the severity.
 * `beside`: sensors whose values stand beside it, and are not repeated.
 */
export function reasonText(
  sensors: Catalogue,
  reason: HealthReason,
  age: number | null,
  isMarked = false,
  beside: readonly string[] = [],
): string {
  const { kind, sensor: name, value, limit } = reason;
  const sensor = sensors.named(name);
  const label = name === '' ? '' : nameOf(sensor);
  const R = S.reasons;
  const ago = age === null ? '' : ` (${S.agoSuffix(ageText(age))})`;
  if (isOfRange(reason)) {
    const edge = reason.release ?? reason.limit;
    const reading = beyondLimitText(sensor, reason.value, edge);
    // "Just below 350" names the limit itself, but not what a value back in its range must pass.
    const isNear = reading !== readingText(sensor, reason.value);
    const limit = limitText(reason, (each) => valueText(sensor, each));
    let text = `${label} ${reading}${ago}, ${limit}`;
    if (isNear && reason.release !== undefined) text = `${beyondText(sensors, reason)}${ago}`;
    else if (isNear) text = `${label} ${reading}${ago}`;
    else if (beside.includes(name)) text = `${label} ${limit}`;
    return isMarked ? text : ratedText(text, reason.verdict);
  }
  switch (kind) {
    case 'range':
      // Its numbers are missing.
      return R.other(S.reasons.outOfRange, label);
    case 'reading_failed':
      return value === null
        ? R.readingFailed(label)
        : R.implausible(`${label} ${readingText(sensor, value)}`);
    case 'scan_failed':
      return R.scanFailed(
        S.attemptOutcomes[attemptOutcome(value ?? NaN)],
        age === null ? null : ageText(age),
      );
    case 'pest':
      // It stays until the next inspection: its alarm, days back, may not be listed any more.
      return `${R.pest(value ?? 0)}${age !== null && age >= 86_400 ? ago : ''}`;
    case 'old':
      return R.old(
        label,
        age === null ? null : ageText(age),
        limit === null ? null : ageText(limit),
        reason.since !== null,
      );
    case 'silent':
      return R.silent;
    case 'stopped':
      return R.stopped;
    case 'changed':
      return R.changed(value === null ? label : `${label} ${readingText(sensor, value)}${ago}`);
    default:
      // A kind from a later server.
      return R.other(shown((kind as string).replaceAll('_', ' '), LONGEST_NAME), label);
  }
}

/** Whether the value is back in its ideal range, but not far enough inside yet. */
export const isBack = ({ release, verdict }: HealthReason): boolean =>
  release !== undefined && verdict === 'stressed';

/** Side and limit; for a value that is back in its range, what it must pass. */
const limitText = (reason: OfRange, text: (value: number) => string): string => {
  const { must, sides } = S.reasons;
  const { release = null, limit } = reason;
  const side = sideOf(reason);
  return release === null ? `${sides[side]} ${text(limit)}` : must[side](text(release));
};

/** Names sensor, side and limit, or what the value has yet to pass; without the value, which changes. */
export function beyondText(sensors: Catalogue, reason: OfRange): string {
  const sensor = sensors.named(reason.sensor);
  return `${nameOf(sensor)} ${limitText(reason, (value) => readingText(sensor, value))}`;
}

/** What to do about it; for what is healthy again, what its alarm still waits for. */
export function todoText(reason: HealthReason): string {
  if (reason.verdict === 'healthy') return reason.kind === 'pest' ? S.todoPestAgain : S.todoWell;
  const { sensors, air, ...kinds } = S.todo;
  if (isBack(reason)) return S.todo.watch;
  // Its last reading was in range, and is too old now.
  if (isOfRange(reason) && reason.verdict === 'unknown') return S.todo.old;
  const which = airOf(reason);
  if (which) return air[which];
  if (isOfRange(reason) && reason.sensor in sensors) {
    return sensors[reason.sensor as keyof typeof sensors][sideOf(reason)];
  }
  // A later server may send other kinds.
  return (kinds as Partial<Record<string, string>>)[reason.kind] ?? kinds.other;
}

export const reasonsText = (
  sensors: Catalogue,
  reasons: readonly HealthReason[],
  age: number | null = null,
  isMarked = false,
  beside: readonly string[] = [],
): string => reasons.map((reason) => reasonText(sensors, reason, age, isMarked, beside)).join('; ');

/** A tag's reasons of one cause (`byCause`) as one: its name, and all its values. */
export function causeText(
  sensors: Catalogue,
  reasons: readonly HealthReason[],
  age: number | null,
  isMarked: boolean,
  beside: readonly string[] = [],
): string {
  const air = reasons.map(airOf)[0];
  if (!air || reasons.length < 2 || reasons.every(isBack)) {
    return reasonsText(sensors, reasons, age, isMarked, beside);
  }
  const ago = age === null ? '' : ` (${S.agoSuffix(ageText(age))})`;
  const others = reasons.filter(({ sensor }) => !beside.includes(sensor));
  const cause = S.airCause[air];
  if (others.length === 0) return cause;
  return `${S.alarmWhat(cause, valuesText(sensors, others, isMarked))}${ago}`;
}

/** Sensors with their values, if there are any, in one line. */
export function valuesText(
  sensors: Catalogue,
  reasons: readonly HealthReason[],
  isMarked = false,
): string {
  const texts = reasons.map(({ sensor: name, value, verdict }) => {
    const sensor = sensors.named(name);
    const text =
      value === null ? nameOf(sensor) : `${nameOf(sensor)} ${readingText(sensor, value)}`;
    return isMarked ? text : ratedText(text, verdict);
  });
  return [...new Set(texts)].join(', ');
}

/** The outcome of an attempt, by the status of its observation (lupin_msgs/Observation). */
type AttemptOutcome = 'ok' | 'unreachable' | 'undecoded' | 'skipped' | 'failed';

const KINDS: readonly AttemptOutcome[] = ['ok', 'unreachable', 'undecoded', 'skipped'];

/** An unknown status counts as a failure. */
export const attemptOutcome = (status: number): AttemptOutcome => KINDS[status] ?? 'failed';
