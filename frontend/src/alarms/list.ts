/** The list of alarms: what is active, put aside and over, in its order. Pure. */
import type { Alarm, Verdict } from '../contract/types';
import { VERDICTS } from '../domain/health';
import { secondsOf } from '../domain/rostime';
import { isShelfHeld, isWorse, whatOf, type Kept } from './kept';

/** What is over stays listed for so long, seconds. */
export const LISTED_S = 86_400;

export interface Item {
  readonly alarm: Alarm;
  /** The worst that was said of it. */
  readonly verdict: Verdict;
  readonly isSeen: boolean;
  /** Until when it is put aside, ms since the epoch; null: it is not. */
  readonly shelvedUntil: number | null;
}

export interface AlarmList {
  /** Active and not put aside: the worst first, of equals the newest. */
  readonly active: readonly Item[];
  /** Active and put aside, in the same order. */
  readonly shelved: readonly Item[];
  /** Cleared by itself: what was cleared last first. */
  readonly over: readonly Item[];
}

export const EMPTY_LIST: AlarmList = { active: [], shelved: [], over: [] };

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
    const seen = kept.seen.get(alarm.id);
    const shelf = kept.shelved.get(whatOf(alarm));
    return {
      alarm,
      verdict,
      isSeen: seen !== undefined && !isWorse(verdict, seen.verdict),
      shelvedUntil: shelf && isShelfHeld(shelf, verdict, at) ? shelf.until : null,
    };
  });
  const active = items.filter(({ alarm }) => alarm.cleared_at === null).sort(worstFirst);
  return {
    active: active.filter(({ shelvedUntil }) => shelvedUntil === null),
    shelved: active.filter(({ shelvedUntil }) => shelvedUntil !== null),
    over: items
      .filter(({ alarm }) => alarm.cleared_at !== null && isListed(endOf(alarm), nowS))
      .sort((a, b) => endOf(b.alarm) - endOf(a.alarm) || byName(a, b)),
  };
}

const isListed = (end: number, nowS: number | null): boolean =>
  nowS === null || nowS - end < LISTED_S;

const beginOf = ({ raised_at }: Alarm): number => secondsOf(raised_at);
const endOf = ({ cleared_at }: Alarm): number => (cleared_at ? secondsOf(cleared_at) : Infinity);

const worstFirst = (a: Item, b: Item): number =>
  VERDICTS.indexOf(a.verdict) - VERDICTS.indexOf(b.verdict) ||
  beginOf(b.alarm) - beginOf(a.alarm) ||
  byName(a, b);

/** Of what came at once the order is the same each time. */
const byName = ({ alarm: a }: Item, { alarm: b }: Item): number => (a.id < b.id ? -1 : 1);

/** Those that call for somebody: active, not seen, not put aside. */
export const calling = ({ active }: AlarmList): readonly Item[] =>
  active.filter(({ isSeen }) => !isSeen);

/** What is new between two lists, to be told once. */
export interface News {
  /** New, come back, or worse than before; the worst first. */
  readonly raised: readonly Item[];
  /** Called before, and cleared by itself since. */
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
    cleared: now.over.filter(({ alarm }) => wasActive.has(alarm.id)),
  };
}

/** The very same as before where it is: what follows from it is kept then. */
export function sharedList(before: AlarmList, now: AlarmList): AlarmList {
  const known = new Map(
    [...before.active, ...before.shelved, ...before.over].map((item) => [item.alarm.id, item]),
  );
  const share = (was: readonly Item[], is: readonly Item[]): readonly Item[] => {
    const items = is.map((item) => sharedItem(known.get(item.alarm.id), item));
    return items.length === was.length && items.every((item, index) => item === was[index])
      ? was
      : items;
  };
  const active = share(before.active, now.active);
  const shelved = share(before.shelved, now.shelved);
  const over = share(before.over, now.over);
  const isSame = active === before.active && shelved === before.shelved && over === before.over;
  return isSame ? before : { active, shelved, over };
}

function sharedItem(was: Item | undefined, is: Item): Item {
  const isSame =
    was?.verdict === is.verdict &&
    was.isSeen === is.isSeen &&
    was.shelvedUntil === is.shelvedUntil &&
    (was.alarm === is.alarm || JSON.stringify(was.alarm) === JSON.stringify(is.alarm));
  return isSame ? was : is;
}
