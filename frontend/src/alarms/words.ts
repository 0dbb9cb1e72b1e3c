/** An alarm in words: what, where, since when, how bad at worst, until when. Pure. */
import type { Alarm } from '../contract/types';
import { ageText, clockText, readingText } from '../domain/format';
import { isOfRange } from '../domain/health';
import { reasonText } from '../domain/reasons';
import { hasDate, rosText, secondsOf } from '../domain/rostime';
import type { Catalogue } from '../domain/sensors';
import { shown } from '../domain/text';
import type { TemperatureUnit } from '../domain/units';
import { S } from '../strings';

/** Of a name that some robot made up. */
const LONGEST_NAME = 24;
/** So many by name in one breath; the list has the rest. */
const MOST_NAMED = 3;

export const whereText = ({ tag_id }: Alarm): string =>
  tag_id === '' ? S.alarmHouse : S.card(shown(tag_id, LONGEST_NAME));

/** What its words need beside it: the sensors in force, and what temperatures are read in. */
export interface Speech {
  readonly sensors: Catalogue;
  readonly unit: TemperatureUnit;
}

/** What was wrong when it was raised. That it got critical is said of how bad it was at worst. */
export const whatText = (alarm: Alarm, speech: Speech): string => {
  const { reason } = alarm;
  const { sensors, unit } = speech;
  const isMilder = isOfRange(reason) && worstText(alarm, speech) !== null;
  return reasonText(sensors, isMilder ? { ...reason, verdict: 'stressed' } : reason, unit, null);
};

/** What and where in one line, and how bad at worst where that alone is critical. */
export const alarmText = (alarm: Alarm, speech: Speech): string => {
  const { reason } = alarm;
  const worst =
    isOfRange(reason) && reason.verdict === 'critical' ? worstText(alarm, speech) : null;
  const what = [whatText(alarm, speech), worst].filter((text) => text !== null).join(', ');
  return S.alarmWhat(whereText(alarm), what);
};

/** How bad it was at worst; null: no worse than when it was raised, or nothing to measure. */
export function worstText({ reason, worst }: Alarm, { sensors, unit }: Speech): string | null {
  const text = (value: number): string =>
    reason.kind === 'pest'
      ? S.reasons.pest(value)
      : readingText(sensors.named(reason.sensor), value, unit);
  if (worst === null || (reason.value !== null && text(worst) === text(reason.value))) return null;
  return S.alarmWorst(text(worst), isOfRange(reason) && reason.verdict === 'critical');
}

/** From when to when. `nowS` is the twin's time, ROS seconds; null: nobody knows. */
export function spanText({ raised_at, cleared_at }: Alarm, nowS: number | null): string {
  const from = secondsOf(raised_at);
  const begin = whenText(from, nowS);
  if (cleared_at === null) {
    return S.alarmSince(begin, nowS === null ? null : ageText(Math.max(0, nowS - from)));
  }
  const until = secondsOf(cleared_at);
  const end = isSameDay(from, until) ? clockOf(until) : whenText(until, nowS);
  return S.alarmUntil(begin, end, ageText(Math.max(0, until - from)));
}

/** A moment: of today the time alone. */
export const whenText = (at: number, nowS: number | null): string =>
  nowS !== null && isSameDay(at, nowS) ? clockOf(at) : rosText(at);

const isSameDay = (a: number, b: number): boolean =>
  hasDate(a) && hasDate(b) && dayOf(a) === dayOf(b);

/** On the operator's own clock. */
const dayOf = (at: number): string => new Date(at * 1000).toDateString();

const clockOf = (at: number): string => clockText(Math.floor(at) * 1000);

/** Some alarms in one breath. */
export function severalText(
  alarms: readonly Alarm[],
  speech: Speech,
  say: (texts: readonly string[], more: number) => string,
): string {
  const texts = alarms.slice(0, MOST_NAMED).map((alarm) => alarmText(alarm, speech));
  return say(texts, alarms.length - texts.length);
}
