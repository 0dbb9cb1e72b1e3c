/** An alarm in words: what, where, value now and at worst, since when, until when. Pure. */
import type { Alarm, HealthReason, Verdict } from '../contract/types';
import { isOldReading, trendOf, type TagThen } from '../domain/difference';
import { ageText, beyondLimitText, minuteText, readingText } from '../domain/format';
import {
  beyondText,
  isOfRange,
  ratedText,
  reasonText,
  sideOf,
  todoText,
  valuesText,
} from '../domain/health';
import type { Catalogue } from '../domain/sensors';
import { shown } from '../domain/text';
import { ageSeconds, dayFormat, hasDate, shortRosText, type When } from '../domain/time';
import { S } from '../strings';
import type { Item } from './list';

/** Longest tag name, characters: names come from the robot. */
const LONGEST_NAME = 24;
const TEN_HOURS_S = 36_000;

export const whereText = ({ tag_id }: Pick<Alarm, 'tag_id'>): string =>
  tag_id === '' ? S.alarmHouse : S.card(shown(tag_id, LONGEST_NAME));

/** What is wrong, without its value, which changes. */
export function whatText({ reason }: Pick<Alarm, 'reason'>, sensors: Catalogue): string {
  if (isOfRange(reason)) return beyondText(sensors, reason);
  // A pest count and a changed sensor's reading are reported as current values; the card says how long
  // readings are valid.
  const value = reason.kind === 'pest' ? 0 : reason.kind === 'changed' ? null : reason.value;
  return reasonText(sensors, { ...reason, value, limit: null }, null);
}

/** What and where in one line, independent of time. */
export const nameText = (alarm: Alarm, sensors: Catalogue): string =>
  S.alarmWhat(whereText(alarm), whatText(alarm, sensors));

/** An alarm's values in words, rounded so that they contradict neither each other nor the limit. */
export interface Values {
  readonly what: string;
  /** What to do about it. */
  readonly todo: string;
  /** Null: the alarm has no value, or is resolved. */
  readonly now: string | null;
  /** Null: no value, or the same as now. */
  readonly worst: string | null;
  readonly first: string | null;
}

export function valuesOf(alarm: Alarm, sensors: Catalogue, now: Now | null): Values {
  const reason = reasonNow(alarm, now);
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
        ? beyondLimitText(sensor, value, reason.release ?? reason.limit)
        : readingText(sensor, value);
  const nowText = (value: number | null): string => {
    if (value === null) {
      return isPest ? S.alarmPests.gone : S.alarmNow(S.alarmStatus.healthy);
    }
    if (!isPest) return S.alarmNow(text(value));
    return value > 0 ? S.alarmNow(S.pestCount(value)) : S.alarmPests.still;
  };
  const value = lastKnown(now)?.value ?? null;
  const worstText = worst === null || (isPest && worst === 0) ? null : text(worst);
  const isMeasured = isOfRange(reason) || isPest || reason.kind === 'changed';
  return {
    what: whatText({ ...alarm, reason }, sensors),
    todo: todoText(reason),
    now: now?.kind === 'known' ? nowText(now.value) : null,
    worst:
      worstText === null || (value !== null && text(value) === worstText)
        ? null
        : S.alarmWorst[isOfRange(reason) ? sideOf(reason) : 'pest'](worstText),
    first: isMeasured && first !== null ? S.alarmFirst(text(first)) : null,
  };
}

/** What, where and the current value in one line; the worst value if it differs. */
export function alarmText(alarm: Alarm, sensors: Catalogue, now: Now | null): string {
  const { what, now: nowText, worst } = valuesOf(alarm, sensors, now);
  const isKnown = now?.kind === 'known';
  const texts = [
    what,
    // Text without a value already says how it is.
    isKnown && nowText !== null && now.value !== null ? ratedText(nowText, now.verdict) : nowText,
    worst === null ? null : ratedText(worst, alarm.reason.verdict),
  ];
  return S.alarmWhat(whereText(alarm), texts.filter((text) => text !== null).join(', '));
}

/** The sensors of a tag's alarms that share a cause, with their values now, if known. */
export const partsText = (
  items: readonly Item[],
  sensors: Catalogue,
  nowOf: (alarm: Alarm) => Now | null,
): string =>
  valuesText(
    sensors,
    items.map(({ alarm }) => {
      const now = nowOf(alarm);
      const { value, verdict } = now?.kind === 'known' ? now : NOT_KNOWN;
      return { ...alarm.reason, value, verdict };
    }),
  );

const NOT_KNOWN = { value: null, verdict: 'unknown' } as const;

/** Says that the value now is unknown, and gives the last known one. */
export function unknownText(
  { reason: { sensor: name } }: Alarm,
  sensors: Catalogue,
  { last }: Extract<Now, { kind: 'unknown' }>,
  age: number | null,
): string {
  const reading = last === null ? null : readingText(sensors.named(name), last);
  return S.alarmNowUnknown(reading, age === null ? null : ageText(age));
}

/**
 * Whether it may have begun before `known`, from when on alarms are known: its tag had no earlier scan,
 * because its first two bad ones are farther apart.
 */
const isOlder = ({ reason: { kind, since }, raised_at }: Alarm, known: number | null): boolean =>
  (kind === 'range' || kind === 'reading_failed' || kind === 'scan_failed') &&
  known !== null &&
  since !== null &&
  since - known < raised_at - since;

/** Since when; at least how long, if it may be older than `known`. */
export function sinceText(alarm: Alarm, nowS: number | null, known: number | null): string {
  const from = alarm.raised_at;
  const length = ageSeconds(from, nowS);
  return length !== null && isOlder(alarm, known)
    ? S.alarmForOver(lengthText(length))
    : S.alarmSince(whenText(from, nowS));
}

/** For how long, unless `sinceText` says it; of an active alarm, only if it began today. Empty: not known. */
export function lengthOf(alarm: Alarm, nowS: number | null, known: number | null): string {
  const { raised_at: from, cleared_at } = alarm;
  if (cleared_at !== null) return lengthText(cleared_at - from);
  const length = ageSeconds(from, nowS);
  const isOfToday = !hasDate(from) || isSameDay(from, nowS ?? from);
  return length === null || !isOfToday || isOlder(alarm, known) ? '' : lengthText(length);
}

/** Begin, end and duration of a resolved alarm; otherwise since when and for how long. */
export function spanText(alarm: Alarm, nowS: number | null, known: number | null): string {
  const { raised_at: from, cleared_at: until } = alarm;
  const length = lengthOf(alarm, nowS, known);
  if (until === null) {
    return `${sinceText(alarm, nowS, known)}${length === '' ? '' : ` (${length})`}`;
  }
  const end = isSameDay(from, until) ? clockOf(until) : whenText(until, nowS);
  return S.alarmUntil(whenText(from, nowS), end, length);
}

export const resolvedText = ({ cleared_at }: Alarm, nowS: number | null): string =>
  cleared_at === null ? '' : `${S.alarmResolved} ${whenText(cleared_at, nowS)}`;

/** Ten hours and more to the hour. */
const lengthText = (seconds: number): string => {
  const text = ageText(Math.max(0, seconds));
  return seconds < TEN_HOURS_S ? inOnePiece(text) : (text.split(' ')[0] ?? text);
};

/** Makes the first space non-breaking. */
export const inOnePiece = (text: string): string => text.replace(' ', '\u00a0');

/** A time to the minute, with the date unless it is today; the year is omitted. */
export function whenText(at: number, nowS: number | null): string {
  if (!hasDate(at)) return shortRosText(at);
  const isToday = nowS !== null && isSameDay(at, nowS);
  return isToday ? clockOf(at) : `${dayFormat.format(at * 1000)}, ${clockOf(at)}`;
}

const isSameDay = (a: number, b: number): boolean =>
  hasDate(a) && hasDate(b) && dayOf(a) === dayOf(b);

/** Calendar day in the browser's time zone. */
const dayOf = (at: number): string => new Date(at * 1000).toDateString();

const clockOf = (at: number): string => minuteText(at * 1000);

export type Now =
  | {
      readonly kind: 'known';
      /** In the sensor's unit; null: a derived value in range. For a pest, the count; null: none. */
      readonly value: number | null;
      /** The value's verdict. */
      readonly verdict: Verdict;
      /** Why; null: in range. */
      readonly reason: HealthReason | null;
      /** Change over the last hour; null: unknown, or the same reading. */
      readonly trend: number | null;
    }
  /** The reading is too old or missing, or the twin is silent. */
  | {
      readonly kind: 'unknown';
      readonly last: number | null;
      readonly lastAt: When;
      /** As last judged, of an old reading or a silent twin; null: unknown then too. */
      readonly before?: Extract<Now, { kind: 'known' }> | null;
    };

const unknown = (
  last: number | null,
  lastAt: When,
  before: Extract<Now, { kind: 'known' }> | null = null,
): Now => ({ kind: 'unknown', last, lastAt, before });

/**
 * An alarm's value now; null: the alarm has no value, or is resolved. `tag` and `hourAgo` are its tag as
 * last judged by the bridge, and an hour earlier; null: unknown. If not `isLive`, the last received
 * value says nothing about now.
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
  // Not judged, for example without a clock: no reasons does not mean healthy.
  if (tag.health.verdict === 'unknown' && reasons.length === 0) {
    return unknown(readings.get(sensor) ?? null, readAt.get(sensor) ?? 'unknown');
  }
  const said = reasons.find((each) => each.kind === kind && each.sensor === sensor);
  const verdict = said?.verdict ?? 'healthy';
  if (isPest) {
    const value = said ? (said.value ?? 0) : null;
    return { kind: 'known', value, verdict, reason: said ?? null, trend: null };
  }
  // A quantity of a day has no reading: only its reason holds the value.
  const isOfDay = readings.size > 0 && !readings.has(sensor);
  const last = isOfDay ? (said?.value ?? null) : (readings.get(sensor) ?? null);
  // In range, it has no reason, and so no known value.
  const lacks = ({ kind: why, verdict: how }: HealthReason): boolean =>
    how === 'unknown' || why === 'reading_failed';
  if (isOfDay && !said && !reasons.some(lacks)) {
    return { kind: 'known', value: null, verdict, reason: null, trend: null };
  }
  if (last === null) return unknown(null, readAt.get(sensor) ?? 'unknown');
  // An alarm may arrive before its reading.
  const read = tag.tag.wire.readings.find(({ name }) => name === sensor)?.observed_at;
  if (read != null && read < alarm.raised_at) return unknown(null, 'unknown');
  if (isOldReading(sensor, tag)) {
    // It is not of now, but its status is that of its tag: a bad one still counts.
    const judged = { value: last, verdict: said?.verdict ?? 'unknown', reason: said ?? null };
    const at = readAt.get(sensor) ?? tag.tag.scannedAt;
    return unknown(last, at, { kind: 'known', ...judged, trend: null });
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

/** The value now, or as last judged; null or undefined: unknown. */
export const lastKnown = (now: Now | null): Extract<Now, { kind: 'known' }> | null | undefined =>
  now?.kind === 'unknown' ? now.before : now;

/** The reason with its current value and verdict; the last reported one if unknown or without a value. */
export function reasonNow({ reason }: Alarm, now: Now | null): HealthReason {
  const known = lastKnown(now);
  if (!known) return reason;
  return known.reason
    ? { ...known.reason, value: known.value ?? reason.value }
    : { ...reason, verdict: known.verdict };
}

/** The worst value, never better than the current one, which may arrive before it; null: none. */
export function worstOf({ reason, worst }: Alarm, now: Now | null): number | null {
  const known = worst ?? (isOfRange(reason) ? reason.value : null);
  const current = now?.kind === 'known' ? now.value : null;
  if (known === null || current === null) return known;
  const isBelow = isOfRange(reason) && sideOf(reason) === 'below';
  return isBelow ? Math.min(known, current) : Math.max(known, current);
}
