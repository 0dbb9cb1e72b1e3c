/** An alarm in words: what, where, how bad now and at worst, since when, until when. Pure. */
import type { Alarm, HealthReason, Verdict } from '../contract/types';
import { isOldReading, trendOf, type TagThen } from '../domain/difference';
import {
  ageText,
  beyondLimitText,
  minuteText,
  readingText,
  type TemperatureUnit,
} from '../domain/format';
import { beyondText, isOfRange, reasonText, sideOf, todoText } from '../domain/health';
import type { Catalogue } from '../domain/sensors';
import { shown } from '../domain/text';
import { dayFormat, hasDate, secondsOf, shortRosText, type When } from '../domain/time';
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

/** What is wrong, without its value, which changes. */
export function whatText({ reason }: Pick<Alarm, 'reason'>, { sensors, unit }: Speech): string {
  if (isOfRange(reason)) return beyondText(sensors, reason, unit);
  // Of a pest how many, and of a changed sensor its reading, is told as it is now.
  const value = reason.kind === 'pest' ? 0 : reason.kind === 'changed' ? null : reason.value;
  return reasonText(sensors, { ...reason, value }, unit, null);
}

/** What and where in one line: of whatever moment it is read. */
export const nameText = (alarm: Alarm, speech: Speech): string =>
  S.alarmWhat(whereText(alarm), whatText(alarm, speech));

/** An alarm's values in words that do not contradict each other, nor its limit. */
export interface Values {
  readonly what: string;
  /** What somebody does about it; empty: nothing. */
  readonly todo: string;
  /** Null: it is not of a value, or resolved. */
  readonly now: string | null;
  /** Null: there is no such value, or it is that of now. */
  readonly worst: string | null;
  readonly first: string | null;
}

export function valuesOf(alarm: Alarm, speech: Speech, now: Now | null): Values {
  const reason = reasonNow(alarm, now);
  const { sensors, unit } = speech;
  const sensor = sensors.named(reason.sensor);
  const worst = worstOf(alarm, now);
  const first = alarm.reason.value;
  const isPest = reason.kind === 'pest';
  const text = (value: number): string =>
    isPest
      ? value > 0
        ? String(value)
        : S.alarmPests.seen
      : isOfRange(reason)
        ? beyondLimitText(sensor, value, reason.release ?? reason.limit, unit)
        : readingText(sensor, value, unit);
  const nowText = (value: number): string =>
    isPest && value > 0 ? S.pestCount(value) : text(value);
  const value = now?.kind === 'known' ? now.value : null;
  const worstText = worst === null || (isPest && worst === 0) ? null : text(worst);
  const noneText = isPest ? S.alarmPests.none : S.alarmStatus.healthy;
  const isMeasured = isOfRange(reason) || isPest || reason.kind === 'changed';
  return {
    what: whatText({ ...alarm, reason }, speech),
    todo: todoText(reason),
    now: now?.kind === 'known' ? S.alarmNow(value === null ? noneText : nowText(value)) : null,
    worst:
      worstText === null || (value !== null && text(value) === worstText)
        ? null
        : S.alarmWorst[isOfRange(reason) ? sideOf(reason) : 'pest'](worstText),
    first: isMeasured && first !== null ? S.alarmFirst(text(first)) : null,
  };
}

/** What and where in one line, as it is now, and how bad at worst where that differs. */
export function alarmText(alarm: Alarm, speech: Speech, now: Now | null): string {
  const { what, now: nowText, worst } = valuesOf(alarm, speech, now);
  const isKnown = now?.kind === 'known';
  const texts = [
    what,
    // What has no value says by itself how it is.
    isKnown && nowText !== null && now.value !== null ? rated(nowText, now.verdict) : nowText,
    worst === null ? null : rated(worst, alarm.reason.verdict),
  ];
  return S.alarmWhat(whereText(alarm), texts.filter((text) => text !== null).join(', '));
}

/** With how bad it is; where nothing is said, it is out of its range. */
const rated = (text: string, verdict: Verdict): string =>
  verdict === 'critical' || verdict === 'healthy' ? `${text} (${S.alarmStatus[verdict]})` : text;

/** That what it is about is not known now, and what was known last. */
export function unknownText(
  { reason: { sensor: name } }: Alarm,
  { sensors, unit }: Speech,
  { last }: Extract<Now, { kind: 'unknown' }>,
  age: number | null,
): string {
  const reading = last === null ? null : readingText(sensors.named(name), last, unit);
  return S.alarmNowUnknown(reading, age === null ? null : ageText(age));
}

/** From when to when. `nowS` is the twin's time, ROS seconds; null: nobody knows. */
export function spanText({ raised_at, cleared_at }: Alarm, nowS: number | null): string {
  const from = secondsOf(raised_at);
  const begin = whenText(from, nowS);
  if (cleared_at === null) {
    return S.alarmSince(begin, nowS === null ? null : lengthText(nowS - from));
  }
  const until = secondsOf(cleared_at);
  const end = isSameDay(from, until) ? clockOf(until) : whenText(until, nowS);
  return S.alarmUntil(begin, end, lengthText(until - from));
}

/** For how long it has been so, or was; and the day that it began on, if it is another; `isOver`: when it was resolved. */
export function timesOf(
  { raised_at, cleared_at }: Alarm,
  nowS: number | null,
  isOver: boolean,
): { readonly length: string; readonly note: string } {
  const from = secondsOf(raised_at);
  const until = cleared_at ? secondsOf(cleared_at) : nowS;
  if (until === null) return { length: whenText(from, nowS), note: '' };
  const isOfToday = !hasDate(from) || isSameDay(from, nowS ?? until);
  const day = isOfToday ? '' : dayFormat.format(from * 1000);
  const note = isOver ? `${S.alarmResolved} ${whenText(until, nowS)}` : day;
  return { length: lengthText(until - from), note };
}

const lengthText = (seconds: number): string => inOnePiece(ageText(Math.max(0, seconds)));

/** A line does not break in it. */
export const inOnePiece = (text: string): string => text.replace(' ', '\u00a0');

/** A moment to the minute: of today the time alone; an alarm's year goes without saying. */
export function whenText(at: number, nowS: number | null): string {
  if (!hasDate(at)) return shortRosText(at);
  const isToday = nowS !== null && isSameDay(at, nowS);
  return isToday ? clockOf(at) : `${dayFormat.format(at * 1000)}, ${clockOf(at)}`;
}

const isSameDay = (a: number, b: number): boolean =>
  hasDate(a) && hasDate(b) && dayOf(a) === dayOf(b);

/** On the operator's own clock. */
const dayOf = (at: number): string => new Date(at * 1000).toDateString();

const clockOf = (at: number): string => minuteText(at * 1000);

/** Some alarms in one breath; `text` is that of one. */
export function severalText(
  alarms: readonly Alarm[],
  text: (alarm: Alarm) => string,
  say: (texts: readonly string[], more: number) => string,
): string {
  const texts = alarms.slice(0, MOST_NAMED).map(text);
  return say(texts, alarms.length - texts.length);
}

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
      /** How it was when the twin fell silent; null: not known then either. */
      readonly before?: Extract<Now, { kind: 'known' }> | null;
    };

const unknown = (
  last: number | null,
  lastAt: When,
  before: Extract<Now, { kind: 'known' }> | null = null,
): Now => ({ kind: 'unknown', last, lastAt, before });

/**
 * `tag` and `hourAgo` are the alarm's tag as the bridge judged it last, and an hour before; null: not
 * known. `isLive`: false, and what was received last says nothing about now. Null: the alarm has no
 * value, or is resolved.
 */
export function nowOf(
  alarm: Alarm,
  tag: TagThen | null,
  hourAgo: TagThen | null,
  isLive: boolean,
): Now | null {
  const { kind, sensor } = alarm.reason;
  const isPest = kind === 'pest';
  if (alarm.cleared_at !== null || !(isPest || kind === 'range' || kind === 'changed')) return null;
  if (!tag) return unknown(null, 'unknown');
  if (!isLive) {
    const before = nowOf(alarm, tag, hourAgo, true);
    if (before?.kind !== 'known') return before;
    return isPest
      ? unknown(null, 'unknown', before)
      : unknown(before.value, tag.tag.readAt.get(sensor) ?? 'unknown', before);
  }
  const { readings, readAt } = tag.tag;
  const { reasons } = tag.health;
  // Not judged, as without a clock: that nothing is said of it does not make it well.
  if (tag.health.verdict === 'unknown' && reasons.length === 0) {
    return unknown(readings.get(sensor) ?? null, readAt.get(sensor) ?? 'unknown');
  }
  const said = reasons.find((each) => each.kind === kind && each.sensor === sensor);
  const verdict = said?.verdict ?? 'healthy';
  if (isPest) {
    const value = said ? (said.value ?? 0) : null;
    return { kind: 'known', value, verdict, reason: said ?? null, trend: null };
  }
  // What is derived has no reading: what there is of it stands in its reason.
  const isDerived = readings.size > 0 && !readings.has(sensor);
  const last = isDerived ? (said?.value ?? null) : (readings.get(sensor) ?? null);
  // Of what is within its range nothing is said, nor what it is.
  const lacks = ({ kind: why, verdict: how }: HealthReason): boolean =>
    how === 'unknown' || why === 'reading_failed';
  if (isDerived && !said && !reasons.some(lacks)) {
    return { kind: 'known', value: null, verdict, reason: null, trend: null };
  }
  if (last === null || isOldReading(sensor, tag)) {
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

/** How it is now, or was when the twin fell silent; nothing: nobody knows. */
export const lastKnown = (now: Now | null): Extract<Now, { kind: 'known' }> | null | undefined =>
  now?.kind === 'unknown' ? now.before : now;

/** Why, as it is now, and how bad that is; as it was said last where nobody knows, or it has no value. */
export function reasonNow({ reason }: Alarm, now: Now | null): HealthReason {
  const known = lastKnown(now);
  if (!known) return reason;
  return known.reason
    ? { ...known.reason, value: known.value ?? reason.value }
    : { ...reason, verdict: known.verdict };
}

/** Its worst value, never better than that of now, which may come first; null: there is none. */
export function worstOf({ reason, worst }: Alarm, now: Now | null): number | null {
  const known = worst ?? (isOfRange(reason) ? reason.value : null);
  const current = now?.kind === 'known' ? now.value : null;
  if (known === null || current === null) return known;
  const isBelow = isOfRange(reason) && sideOf(reason) === 'below';
  return isBelow ? Math.min(known, current) : Math.max(known, current);
}
