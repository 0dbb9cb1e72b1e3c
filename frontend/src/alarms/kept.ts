/**
 * What this browser keeps about alarms: which were seen, which are put aside, and whether it may
 * make itself heard. Nothing of it goes to a server. Pure; moments are ms since the epoch.
 */
import type { Alarm, Verdict } from '../contract/types';
import { isOfRange, sideOf, VERDICTS } from '../domain/health';

/** More than any list has; the oldest go first. */
export const MOST_SEEN = 1_000;
export const MOST_SHELVED = 200;
/** What was seen and is listed no more is forgotten after this long, ms. */
export const FORGET_MS = 7 * 86_400_000;
/** Nothing is put aside for longer, ms. */
export const LONGEST_SHELF_MS = 8 * 3_600_000;

/** For how long an alarm can be put aside, minutes. */
export const SHELF_MINUTES = [15, 60, 480] as const;

export interface Seen {
  /** How bad it was when it was seen. */
  readonly verdict: Verdict;
  /** When it was seen. */
  readonly at: number;
}

export interface Shelf {
  /** How bad it was when it was put aside. */
  readonly verdict: Verdict;
  readonly until: number;
}

export interface Kept {
  /** By the alarm's id. */
  readonly seen: ReadonlyMap<string, Seen>;
  /** By `whatOf`: an alarm that comes back is as unwelcome as before. */
  readonly shelved: ReadonlyMap<string, Shelf>;
  readonly sound: boolean;
  readonly notify: boolean;
}

export const NOTHING_KEPT: Kept = {
  seen: new Map(),
  shelved: new Map(),
  sound: false,
  notify: false,
};

/** Whether a verdict is worse than another. */
export const isWorse = (a: Verdict, b: Verdict): boolean =>
  VERDICTS.indexOf(a) < VERDICTS.indexOf(b);

/** What is wrong and where, whenever it is: too cold is not too warm. */
export const whatOf = ({ tag_id, reason }: Alarm): string =>
  JSON.stringify([tag_id, reason.kind, reason.sensor, isOfRange(reason) ? sideOf(reason) : '']);

/** An alarm and how bad it is by now. */
export interface Rated {
  readonly alarm: Alarm;
  readonly verdict: Verdict;
}

export function markSeen(kept: Kept, alarms: readonly Rated[], at: number): Kept {
  const seen = new Map(kept.seen);
  for (const { alarm, verdict } of alarms) {
    // The newest last, so that the oldest are the first to go.
    seen.delete(alarm.id);
    seen.set(alarm.id, { verdict, at });
  }
  return { ...kept, seen };
}

export function shelve(kept: Kept, { alarm, verdict }: Rated, until: number): Kept {
  const shelved = new Map(kept.shelved);
  shelved.delete(whatOf(alarm));
  shelved.set(whatOf(alarm), { verdict, until });
  return { ...kept, shelved };
}

export function unshelve(kept: Kept, alarm: Alarm): Kept {
  const shelved = new Map(kept.shelved);
  shelved.delete(whatOf(alarm));
  return { ...kept, shelved };
}

/** The same without what is over: shelves that ended, and what was seen long ago and is not listed. */
export function pruned(kept: Kept, listed: ReadonlySet<string>, at: number): Kept {
  const seen = [...kept.seen].filter(
    ([id, each]) => listed.has(id) || Math.abs(at - each.at) < FORGET_MS,
  );
  const shelved = [...kept.shelved].filter(([, { until }]) => isAhead(until, at));
  if (
    seen.length === kept.seen.size &&
    shelved.length === kept.shelved.size &&
    seen.length <= MOST_SEEN &&
    shelved.length <= MOST_SHELVED
  ) {
    return kept;
  }
  return {
    ...kept,
    seen: new Map(seen.slice(-MOST_SEEN)),
    shelved: new Map(shelved.slice(-MOST_SHELVED)),
  };
}

/** Not for ever where somebody sets the clock back. */
const isAhead = (until: number, at: number): boolean =>
  until > at && until - at <= LONGEST_SHELF_MS;

export const isShelfHeld = (shelf: Shelf, verdict: Verdict, at: number): boolean =>
  isAhead(shelf.until, at) && !isWorse(verdict, shelf.verdict);

/** When the next shelf ends; null: there is none. */
export const nextEnd = (kept: Kept, at: number): number | null => {
  const ends = [...kept.shelved.values()].map(({ until }) => until).filter((until) => until > at);
  return ends.length > 0 ? Math.min(...ends) : null;
};

const KEY = 'lupin-twin.alarms';
/** Another tab of this browser has kept something: this is what it wrote. */
export const isKept = (key: string | null): boolean => key === KEY || key === null;

/** Reads what was kept; anything unknown or damaged counts as not kept. */
export function readKept(storage: Pick<Storage, 'getItem'>): Kept {
  let parsed: unknown;
  try {
    parsed = JSON.parse(storage.getItem(KEY) ?? '{}');
  } catch {
    return NOTHING_KEPT;
  }
  if (typeof parsed !== 'object' || parsed === null) return NOTHING_KEPT;
  const { seen, shelved, sound, notify } = parsed as Readonly<Record<string, unknown>>;
  return {
    seen: new Map(rows(seen, MOST_SEEN).map(([id, verdict, at]) => [id, { verdict, at }])),
    shelved: new Map(
      rows(shelved, MOST_SHELVED).map(([what, verdict, until]) => [what, { verdict, until }]),
    ),
    sound: sound === true,
    notify: notify === true,
  };
}

type KeptRow = readonly [string, Verdict, number];

const rows = (list: unknown, most: number): readonly KeptRow[] =>
  Array.isArray(list) ? list.filter(isRow).slice(-most) : [];

function isRow(row: unknown): row is KeptRow {
  if (!Array.isArray(row)) return false;
  const [name, verdict, moment] = row as readonly unknown[];
  return (
    typeof name === 'string' &&
    VERDICTS.some((each) => each === verdict) &&
    typeof moment === 'number' &&
    Number.isFinite(moment)
  );
}

export function writeKept(storage: Pick<Storage, 'setItem'>, kept: Kept): void {
  const seen = [...kept.seen].map(([id, { verdict, at }]) => [id, verdict, at]);
  const shelved = [...kept.shelved].map(([what, { verdict, until }]) => [what, verdict, until]);
  const { sound, notify } = kept;
  try {
    storage.setItem(KEY, JSON.stringify({ seen, shelved, sound, notify }));
  } catch {
    // Storage is full or forbidden: it then lasts as long as the page.
  }
}
