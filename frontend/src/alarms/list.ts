/** The list of alarms: what is active, shelved and resolved, in its order. Pure. */
import type { Alarm, HealthReason, Verdict } from '../contract/types';
import { isOfRange, severity, sideOf } from '../domain/health';
import { groupedBy, withParts } from '../domain/memo';
import { secondsOf } from '../domain/time';
import { compareIds, equal } from '../domain/twin';
import { isShelfHeld, isWorse, whatOf, type Kept, type Shelf } from './own';
import type { Speech } from './words';

/** What is resolved stays listed for so long, seconds. */
export const LISTED_S = 86_400;

/** More alarms than this of one cause stand below one heading. */
export const MOST_LOOSE = 4;

/** What is wrong where: an alarm, or what has none yet. */
export interface Wrong {
  readonly alarm: Pick<Alarm, 'id' | 'tag_id' | 'reason'>;
}

export interface Item {
  readonly alarm: Alarm;
  /** The worst that was said of it. */
  readonly verdict: Verdict;
  readonly isAcknowledged: boolean;
  /** Null: it is not shelved. */
  readonly shelf: Shelf | null;
}

export interface AlarmList {
  /** Active and not shelved: the worst first (`severity`). */
  readonly active: readonly Item[];
  /** Active and shelved, in the same order. */
  readonly shelved: readonly Item[];
  /** What was resolved last first. */
  readonly resolved: readonly Item[];
}

/** Where it belongs by now; in a list that is held it may still stand elsewhere. */
export const groupOf = ({ alarm, shelf }: Item): keyof AlarmList =>
  alarm.cleared_at !== null ? 'resolved' : shelf !== null ? 'shelved' : 'active';

export const EMPTY_LIST: AlarmList = { active: [], shelved: [], resolved: [] };

/**
 * `nowS` is the twin's time (ROS seconds; null: nobody knows), `at` the browser's, ms since the epoch.
 */
export function listOf(
  alarms: readonly Alarm[],
  kept: Kept,
  nowS: number | null,
  at: number,
): AlarmList {
  const items = alarms.map((alarm): Item => {
    const { verdict } = alarm.reason;
    const known = kept.acknowledged.get(alarm.id);
    const shelf = kept.shelved.get(whatOf(alarm));
    return {
      alarm,
      verdict,
      isAcknowledged: known !== undefined && !isWorse(verdict, known.verdict),
      shelf: shelf && isShelfHeld(shelf, verdict, at) ? shelf : null,
    };
  });
  const active = inOrder(
    items.filter(({ alarm }) => alarm.cleared_at === null),
    ({ alarm }) => alarm.reason,
  );
  return {
    active: active.filter((item) => item.shelf === null),
    shelved: active.filter((item) => item.shelf !== null),
    resolved: items
      .filter(({ alarm }) => alarm.cleared_at !== null && isListed(endOf(alarm), nowS))
      .sort((a, b) => endOf(b.alarm) - endOf(a.alarm) || byName(a, b)),
  };
}

const isListed = (end: number, nowS: number | null): boolean =>
  nowS === null || nowS - end < LISTED_S;

const endOf = ({ cleared_at }: Alarm): number => (cleared_at ? secondsOf(cleared_at) : Infinity);

/** In the order of `severity`, by the reasons that are given; of equals it is the same each time. */
const inOrder = (items: readonly Item[], reasonOf: (item: Item) => HealthReason): readonly Item[] =>
  items
    .map((item) => ({ item, rank: rankOf(reasonOf(item), item.isAcknowledged) }))
    .sort((a, b) => b.rank - a.rank || byName(a.item, b.item))
    .map(({ item }) => item);

/** An alarm's `severity`, for that reason. */
const rankOf = (reason: HealthReason, isAcknowledged: boolean): number =>
  severity({ verdict: reason.verdict, reasons: [reason] }, isAcknowledged);

const byName = ({ alarm: a }: Item, { alarm: b }: Item): number =>
  compareIds(a.tag_id, b.tag_id) || (a.id < b.id ? -1 : 1);

/**
 * By how bad each is, then whether it is not acknowledged (both are the whole part of `severity`), then by
 * how many its block has: a block stands where the first of it does. In a block as `inOrder`.
 */
export function causesFirst(
  items: readonly Item[],
  reasonOf: (item: Item) => HealthReason,
  speech: Speech,
): readonly Item[] {
  const ranked = inOrder(items, reasonOf).map((item) => ({
    item,
    urgency: Math.floor(rankOf(reasonOf(item), item.isAcknowledged)),
    cause: causeOf(item.alarm, speech),
  }));
  const causes = groupedBy(ranked, ({ cause }) => cause);
  const countOf = ({ cause }: (typeof ranked)[number]): number => {
    const count = causes.get(cause)?.length ?? 0;
    return count > MOST_LOOSE ? count : 1;
  };
  return ranked
    .sort((a, b) => b.urgency - a.urgency || countOf(b) - countOf(a))
    .map(({ item }) => item);
}

/** What is wrong in which area, by whatever limit. */
export const causeOf = ({ reason, tag_id }: Wrong['alarm'], { sensors }: Speech): string =>
  [
    ...[reason.kind, reason.sensor, isOfRange(reason) ? sideOf(reason) : ''],
    sensors.areaOf(tag_id),
  ].join('|');

/** The one that was raised first. */
export const oldestOf = (items: readonly Item[]): Alarm | undefined =>
  items
    .map(({ alarm }) => alarm)
    .sort((a, b) => secondsOf(a.raised_at) - secondsOf(b.raised_at))[0];

/** Neither acknowledged nor shelved; in a list that is held, both still stand where they were. */
export const unacknowledged = (items: readonly Item[]): readonly Item[] =>
  items.filter(({ isAcknowledged, shelf }) => !isAcknowledged && shelf === null);

/** Those that call for somebody: active, not acknowledged, not shelved. */
export const calling = ({ active }: AlarmList): readonly Item[] =>
  unacknowledged(active).filter(({ alarm }) => alarm.cleared_at === null);

/** The alarm of why a tag is as it is; that it is too cold is not that it was too warm. */
export const alarmOf = (
  items: readonly Item[],
  tagId: string,
  reason: HealthReason | undefined,
): Item | undefined =>
  reason &&
  items.find(
    ({ alarm }) => alarm.tag_id === tagId && whatOf(alarm) === whatOf({ tag_id: tagId, reason }),
  );

/** Whether a second scan that says the same raises the alarm of a reason. */
export const isAwaited = ({ kind, release }: HealthReason): boolean =>
  kind === 'reading_failed' || (kind === 'range' && release === undefined);

/** What is new between two lists, to be told once. */
export interface News {
  /** New, come back, or worse than before; the worst first. */
  readonly raised: readonly Item[];
  /** Active before, and resolved since. */
  readonly cleared: readonly Item[];
}

export function newsOf(before: AlarmList, now: AlarmList): News {
  const called = new Map(calling(before).map(({ alarm, verdict }) => [alarm.id, verdict]));
  const wasActive = new Set(before.active.map(({ alarm }) => alarm.id));
  return {
    raised: calling(now).filter(({ alarm, verdict }) => {
      const known = called.get(alarm.id);
      return known === undefined || isWorse(verdict, known);
    }),
    cleared: now.resolved.filter(({ alarm }) => wasActive.has(alarm.id)),
  };
}

/** A list whose order is held, and what has become active since. */
export interface HeldList {
  /** The rows of then as they are now: none comes, goes or moves. */
  readonly shown: AlarmList;
  readonly added: readonly Item[];
}

export function heldList(held: AlarmList, now: AlarmList): HeldList {
  const items = new Map(itemsOf(now).map((item) => [item.alarm.id, item]));
  const keep = (rows: readonly Item[]): readonly Item[] =>
    rows.map((item) => items.get(item.alarm.id) ?? item);
  const known = new Set(itemsOf(held).map(({ alarm }) => alarm.id));
  return {
    shown: {
      active: keep(held.active),
      shelved: keep(held.shelved),
      resolved: keep(held.resolved),
    },
    added: now.active.filter(({ alarm }) => !known.has(alarm.id)),
  };
}

export const itemsOf = ({ active, shelved, resolved }: AlarmList): readonly Item[] => [
  ...active,
  ...shelved,
  ...resolved,
];

/** The very same as before where it is: what follows from it is kept then. */
export function sharedList(before: AlarmList, now: AlarmList): AlarmList {
  const known = new Map(itemsOf(before).map((item) => [item.alarm.id, item]));
  const share = (was: readonly Item[], is: readonly Item[]): readonly Item[] => {
    const items = is.map((item) => {
      const before = known.get(item.alarm.id);
      return before && equal(before, item) ? before : item;
    });
    return items.length === was.length && items.every((item, index) => item === was[index])
      ? was
      : items;
  };
  return withParts(before, {
    active: share(before.active, now.active),
    shelved: share(before.shelved, now.shelved),
    resolved: share(before.resolved, now.resolved),
  });
}
