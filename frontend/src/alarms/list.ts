/** The alarm list: active, shelved and resolved alarms, each sorted. Pure. */
import type { Alarm, HealthReason } from '../contract/types';
import { numberText } from '../domain/format';
import { airOf, isOfRange, severity, sideOf } from '../domain/health';
import { withParts } from '../domain/memo';
import type { Catalogue } from '../domain/sensors';
import { compareIds, equal } from '../domain/twin';
import { isShelfHeld, isWorse, faultKey, type LocalAlarms, type Shelf } from './own';

/** How long a resolved alarm stays listed, seconds. */
export const LISTED_S = 86_400;

/** Most alarms that the bridge sends: the worst active ones, then those resolved last. */
const MOST_SENT = 1_000;

/** Above this many, alarms that share a cause are grouped under one heading. */
export const MOST_LOOSE = 4;

/** A fault at a tag: an alarm, or a reason without an alarm yet. */
export interface Wrong {
  readonly alarm: Pick<Alarm, 'id' | 'tag_id' | 'reason'>;
}

export interface Item {
  readonly alarm: Alarm;
  readonly isAcknowledged: boolean;
  /** Null: not shelved. */
  readonly shelf: Shelf | null;
}

export interface AlarmList {
  /** Active and not shelved, the worst first (`severity`). */
  readonly active: readonly Item[];
  /** Active and shelved, in the same order. */
  readonly shelved: readonly Item[];
  /** The last resolved first. */
  readonly resolved: readonly Item[];
}

/** The group where the alarm belongs; a held list may still show it in another. */
export const groupOf = ({ alarm, shelf }: Item): keyof AlarmList =>
  alarm.cleared_at !== null ? 'resolved' : shelf !== null ? 'shelved' : 'active';

/** A list with each of its groups changed. */
export const inEach = (
  list: AlarmList,
  change: (items: readonly Item[], group: keyof AlarmList) => readonly Item[],
): AlarmList => ({
  active: change(list.active, 'active'),
  shelved: change(list.shelved, 'shelved'),
  resolved: change(list.resolved, 'resolved'),
});

export const EMPTY_LIST: AlarmList = { active: [], shelved: [], resolved: [] };

/**
 * `nowS` is the twin's time (ROS seconds; null: unknown), `at` the browser's, ms since the epoch.
 */
export function listOf(
  alarms: readonly Alarm[],
  local: LocalAlarms,
  nowS: number | null,
  at: number,
): AlarmList {
  const items = alarms.map((alarm): Item => {
    const known = local.acknowledged.get(alarm.id);
    const shelf = local.shelved.get(faultKey(alarm));
    const { verdict } = alarm.reason;
    return {
      alarm,
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

const endOf = ({ cleared_at }: Alarm): number => cleared_at ?? Infinity;

/** Sorted by the `severity` of the given reasons; ties by tag and id, so that the order is stable. */
export const inOrder = (
  items: readonly Item[],
  reasonOf: (item: Item) => HealthReason,
): readonly Item[] =>
  items
    .map((item) => {
      const reason = reasonOf(item);
      // While nothing arrives, that is the one to act on.
      if (reason.kind === 'silent') return { item, rank: Infinity };
      return {
        item,
        rank: severity({ verdict: reason.verdict, reasons: [reason] }, item.isAcknowledged),
      };
    })
    .sort((a, b) => b.rank - a.rank || byName(a.item, b.item))
    .map(({ item }) => item);

const byName = ({ alarm: a }: Item, { alarm: b }: Item): number =>
  compareIds(a.tag_id, b.tag_id) || (a.id < b.id ? -1 : 1);

/** Key of a cause: damp or dry air, else kind, sensor and side, whatever the limit; and area. */
export function causeOf({ reason, tag_id }: Wrong['alarm'], sensors: Catalogue): string {
  const side = isOfRange(reason) ? sideOf(reason) : '';
  const cause = airOf(reason) ?? `${reason.kind}|${reason.sensor}|${side}`;
  return `${cause}|${sensors.areaOf(tag_id)}`;
}

/** The alarm raised first. */
export const oldestOf = (items: readonly Item[]): Alarm | undefined =>
  items.map(({ alarm }) => alarm).sort((a, b) => a.raised_at - b.raised_at)[0];

/** Items neither acknowledged nor shelved; a held list may contain both. */
export const unacknowledged = (items: readonly Item[]): readonly Item[] =>
  items.filter(({ isAcknowledged, shelf }) => !isAcknowledged && shelf === null);

/** Items that need attention: active, not acknowledged, not shelved. */
export const calling = ({ active }: AlarmList): readonly Item[] =>
  unacknowledged(active).filter(({ alarm }) => alarm.cleared_at === null);

/** How many alarms a group has: "1,000+", if the bridge may have more. */
export function countText(list: AlarmList, group: keyof AlarmList): string {
  const { active, shelved, resolved } = list;
  const sent = active.length + shelved.length + (group === 'resolved' ? resolved.length : 0);
  return numberText(list[group].length, 0) + (sent < MOST_SENT ? '' : '+');
}

/** The alarm of a tag's reason; "too cold" and "too warm" are different alarms. */
export const alarmOf = (
  items: readonly Item[],
  tagId: string,
  reason: HealthReason | undefined,
): Item | undefined =>
  reason &&
  items.find(
    ({ alarm }) =>
      alarm.tag_id === tagId && faultKey(alarm) === faultKey({ tag_id: tagId, reason }),
  );

/** Whether a reason's alarm waits for a second scan to confirm it. */
export const isAwaited = ({ kind, release }: HealthReason): boolean =>
  kind === 'reading_failed' ||
  kind === 'scan_failed' ||
  (kind === 'range' && release === undefined);

/** Changes between two lists, to be announced once. */
export interface News {
  /** New, back from shelved or acknowledged, or worse than before; the worst first. */
  readonly raised: readonly Item[];
  /** Resolved since, after being active. */
  readonly cleared: readonly Item[];
}

export function newsOf(before: AlarmList, now: AlarmList): News {
  const called = new Map(calling(before).map(({ alarm }) => [alarm.id, alarm.reason.verdict]));
  const wasActive = new Set(before.active.map(({ alarm }) => alarm.id));
  return {
    raised: calling(now).filter(({ alarm: { id, reason } }) => {
      const known = called.get(id);
      return known === undefined || isWorse(reason.verdict, known);
    }),
    cleared: now.resolved.filter(({ alarm }) => wasActive.has(alarm.id)),
  };
}

/** A list whose order is held, and the alarms that have become active since. */
export interface HeldList {
  /** The held rows with current content: none is added, removed or moved. */
  readonly shown: AlarmList;
  readonly added: readonly Item[];
}

export function heldList(held: AlarmList, now: AlarmList): HeldList {
  const items = new Map(itemsOf(now).map((item) => [item.alarm.id, item]));
  const known = new Set(itemsOf(held).map(({ alarm }) => alarm.id));
  return {
    shown: inEach(held, (rows) => rows.map((item) => items.get(item.alarm.id) ?? item)),
    added: now.active.filter(({ alarm }) => !known.has(alarm.id)),
  };
}

export const itemsOf = ({ active, shelved, resolved }: AlarmList): readonly Item[] => [
  ...active,
  ...shelved,
  ...resolved,
];

/** `now`, reusing equal objects of `before`, so that what is memoised on them stays valid. */
export function sharedList(before: AlarmList, now: AlarmList): AlarmList {
  const known = new Map(itemsOf(before).map((item) => [item.alarm.id, item]));
  const shared = inEach(now, (is, group) => {
    const was = before[group];
    const items = is.map((item) => {
      const same = known.get(item.alarm.id);
      return same && equal(same, item) ? same : item;
    });
    return items.length === was.length && items.every((item, at) => item === was[at]) ? was : items;
  });
  return withParts(before, shared);
}
