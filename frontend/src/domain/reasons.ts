/** Why a tag or the house has its verdict, in words. */
import type { HealthReason } from '../contract/types';
import { S } from '../strings';
import { beyondLimitText, durationText, readingText, shortAgeText, valueText } from './format';
import { isOfRange, sideOf } from './health';
import type { Catalogue } from './sensors';
import { shown } from './text';
import type { TemperatureUnit } from './units';

/** Of a name that some twin made up. */
const LONGEST_NAME = 32;

/**
 * A reason as a sentence without its full stop. `age` is how long ago the observation was that
 * says so, seconds; null: that is told elsewhere, or nobody knows. `isMarked`: a sign beside it says
 * how bad it is.
 */
export function reasonText(
  sensors: Catalogue,
  reason: HealthReason,
  unit: TemperatureUnit,
  age: number | null,
  isMarked = false,
): string {
  const { kind, sensor: name, value, limit } = reason;
  const sensor = sensors.named(name);
  const label = name === '' ? '' : shown(sensor.label, LONGEST_NAME);
  const R = S.reasons;
  if (isOfRange(reason)) {
    const edge = reason.release ?? reason.limit;
    const reading = beyondLimitText(sensor, reason.value, edge, unit);
    const isHeld = reason.release !== undefined;
    // "Just below 350" names the limit itself.
    const isNear = !isHeld && reading !== readingText(sensor, reason.value, unit);
    const limit = limitText(reason, (each) => valueText(sensor, each, unit));
    const isRated = reason.verdict === 'critical' && !isMarked && !isHeld;
    const rated = isRated ? ` (${S.alarmStatus.critical})` : '';
    return `${label} ${reading}${isNear ? '' : `, ${limit}`}${rated}`;
  }
  switch (kind) {
    case 'range':
      // Without its numbers it says no more than that.
      return R.other(S.reasons.outOfRange, label);
    case 'reading_failed':
      return value === null
        ? R.readingFailed(label)
        : R.implausible(`${label} ${readingText(sensor, value, unit)}`);
    case 'scan_failed':
      return R.scanFailed(S.tried[tryKind(value ?? NaN)], age === null ? null : shortAgeText(age));
    case 'pest':
      return R.pest(value ?? 0);
    case 'old':
      return R.old(
        label,
        age === null ? null : shortAgeText(age),
        limit === null ? null : durationText(limit),
        reason.since !== null,
      );
    case 'silent':
      return R.silent;
    case 'stopped':
      return R.stopped;
    case 'changed':
      return R.changed(value === null ? label : `${label} ${readingText(sensor, value, unit)}`);
    default:
      // Of a later server.
      return R.other(shown((kind as string).replaceAll('_', ' '), LONGEST_NAME), label);
  }
}

type OfRange = HealthReason & { readonly value: number; readonly limit: number };

/** Whether the value is back in its ideal range, and has yet to lie well within. */
export const isBack = ({ release, verdict }: HealthReason): boolean =>
  release !== undefined && verdict === 'stressed';

/** On which side of which limit a value is, or was. */
function limitText(reason: OfRange, text: (value: number) => string): string {
  const { limit, release = null, verdict } = reason;
  const side = S.reasons.sides[sideOf(reason)];
  return release === null
    ? `${side} ${text(limit)}`
    : S.reasons.wasBeyond(side, text(limit), S.health[verdict].toLowerCase(), text(release));
}

/** What lies on which side of which limit, without the value: that changes. */
export function beyondText(sensors: Catalogue, reason: OfRange, unit: TemperatureUnit): string {
  const sensor = sensors.named(reason.sensor);
  const limit = limitText(reason, (value) => readingText(sensor, value, unit));
  return `${shown(sensor.label, LONGEST_NAME)} ${limit}`;
}

/**
 * What somebody does about it; of what is well by now, what its alarm still waits for.
 * Empty: nothing, as it is back in its range, and the reason says when that ends it.
 */
export function todoText(reason: HealthReason): string {
  if (reason.verdict === 'healthy') return reason.kind === 'pest' ? S.todoPestAgain : S.todoWell;
  const { sensors, ...kinds } = S.todo;
  if (isBack(reason)) return '';
  if (isOfRange(reason) && reason.sensor in sensors) {
    return sensors[reason.sensor as keyof typeof sensors][sideOf(reason)];
  }
  // Of a later server, a kind may be another.
  return (kinds as Partial<Record<string, string>>)[reason.kind] ?? kinds.other;
}

/** All reasons in one line, the worst first. */
export const reasonsText = (
  sensors: Catalogue,
  reasons: readonly HealthReason[],
  unit: TemperatureUnit,
): string => reasons.map((reason) => reasonText(sensors, reason, unit, null)).join('; ');

/** What became of a try, by the status of its observation (lupin_msgs/Observation). */
export type TryKind = 'ok' | 'unreachable' | 'undecoded' | 'skipped' | 'failed';

const KINDS: readonly TryKind[] = ['ok', 'unreachable', 'undecoded', 'skipped'];

/** A status that is not known yet is a failure of some kind. */
export const tryKind = (status: number): TryKind => KINDS[status] ?? 'failed';
