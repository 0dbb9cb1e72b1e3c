/**
 * What this browser keeps about alarms, the same in every tab: which are acknowledged, which are shelved,
 * and whether it may make itself heard. What who has signed in does, `people.ts` says to the bridge too. Moments
 * are ms since the epoch.
 */
import { timeOfDay } from '../clock';
import type { Alarm, Verdict } from '../contract/types';
import { isOfRange, sideOf, VERDICTS } from '../domain/health';
import { createStore } from '../store/create';

/** More than any list has; the oldest go first. */
export const MOST_ACKNOWLEDGED = 1_000;
export const MOST_SHELVED = 200;
/** What was acknowledged and is listed no more is forgotten after this long, ms. */
export const FORGET_MS = 7 * 86_400_000;
/** For how long an alarm can be shelved, minutes: a critical one not as long. */
export const shelfMinutes = (verdict: Verdict): readonly number[] =>
  verdict === 'critical' ? [15, 60] : [15, 60, 480];

/** Nothing is shelved for longer, ms. */
const longestShelfMs = (verdict: Verdict): number => Math.max(...shelfMinutes(verdict)) * 60_000;

/** A reason is a short one, characters. */
export const LONGEST_REASON = 120;

/** Nobody shelves a critical alarm by the way: it takes a word why. */
export const needsReason = (verdict: Verdict): boolean => verdict === 'critical';

interface Acknowledgement {
  /** How bad it was when it was acknowledged. */
  readonly verdict: Verdict;
  /** When it was acknowledged. */
  readonly at: number;
}

export interface Shelf {
  /** How bad it was when it was shelved. */
  readonly verdict: Verdict;
  readonly until: number;
  /** In the operator's words; may be empty. */
  readonly reason: string;
}

export interface Kept {
  /** By the alarm's id. */
  readonly acknowledged: ReadonlyMap<string, Acknowledgement>;
  /** By `whatOf`: an alarm that comes back is as unwelcome as before. */
  readonly shelved: ReadonlyMap<string, Shelf>;
  readonly sound: boolean;
  readonly notify: boolean;
}

export const NOTHING_KEPT: Kept = {
  acknowledged: new Map(),
  shelved: new Map(),
  sound: false,
  notify: false,
};

/** Whether a verdict is worse than another. */
export const isWorse = (a: Verdict, b: Verdict): boolean =>
  VERDICTS.indexOf(a) < VERDICTS.indexOf(b);

/** What is wrong and where, whenever it is: too cold is not too warm. */
export const whatOf = ({ tag_id, reason }: Pick<Alarm, 'tag_id' | 'reason'>): string =>
  JSON.stringify([tag_id, reason.kind, reason.sensor, isOfRange(reason) ? sideOf(reason) : '']);

/** An alarm and how bad it is by now. */
export interface Rated {
  readonly alarm: Alarm;
  readonly verdict: Verdict;
}

export function acknowledge(kept: Kept, alarms: readonly Rated[], at: number): Kept {
  const acknowledged = new Map(kept.acknowledged);
  for (const { alarm, verdict } of alarms) {
    // The newest last, so that the oldest are the first to go.
    acknowledged.delete(alarm.id);
    acknowledged.set(alarm.id, { verdict, at });
  }
  return { ...kept, acknowledged };
}

export function unacknowledge(kept: Kept, alarm: Alarm): Kept {
  const acknowledged = new Map(kept.acknowledged);
  acknowledged.delete(alarm.id);
  return { ...kept, acknowledged };
}

export function shelve(kept: Kept, { alarm, verdict }: Rated, until: number, reason: string): Kept {
  const shelved = new Map(kept.shelved);
  shelved.delete(whatOf(alarm));
  shelved.set(whatOf(alarm), { verdict, until, reason });
  return { ...kept, shelved };
}

export function unshelve(kept: Kept, alarm: Alarm): Kept {
  const shelved = new Map(kept.shelved);
  shelved.delete(whatOf(alarm));
  return { ...kept, shelved };
}

/** The same without shelves that ended, and what was acknowledged long ago and is not listed. */
export function pruned(kept: Kept, listed: ReadonlySet<string>, at: number): Kept {
  const acknowledged = [...kept.acknowledged].filter(
    ([id, each]) => listed.has(id) || Math.abs(at - each.at) < FORGET_MS,
  );
  const shelved = [...kept.shelved].filter(([, shelf]) => isAhead(shelf, at));
  if (
    acknowledged.length === kept.acknowledged.size &&
    shelved.length === kept.shelved.size &&
    acknowledged.length <= MOST_ACKNOWLEDGED &&
    shelved.length <= MOST_SHELVED
  ) {
    return kept;
  }
  return {
    ...kept,
    acknowledged: new Map(acknowledged.slice(-MOST_ACKNOWLEDGED)),
    shelved: new Map(shelved.slice(-MOST_SHELVED)),
  };
}

/** Not for ever where somebody sets the clock back. */
const isAhead = ({ verdict, until }: Shelf, at: number): boolean =>
  until > at && until - at <= longestShelfMs(verdict);

export const isShelfHeld = (shelf: Shelf, verdict: Verdict, at: number): boolean =>
  isAhead(shelf, at) && !isWorse(verdict, shelf.verdict);

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
  const { acknowledged, shelved, sound, notify } = parsed as Readonly<Record<string, unknown>>;
  return {
    acknowledged: new Map(
      rows(acknowledged, MOST_ACKNOWLEDGED).map(([id, verdict, at]) => [id, { verdict, at }]),
    ),
    shelved: new Map(
      rows(shelved, MOST_SHELVED).map(([what, verdict, until, reason = '']) => [
        what,
        { verdict, until, reason: reason.slice(0, LONGEST_REASON) },
      ]),
    ),
    sound: sound === true,
    notify: notify === true,
  };
}

type KeptRow = readonly [string, Verdict, number, string?];

const rows = (list: unknown, most: number): readonly KeptRow[] =>
  Array.isArray(list) ? list.filter(isRow).slice(-most) : [];

function isRow(row: unknown): row is KeptRow {
  if (!Array.isArray(row)) return false;
  const [name, verdict, moment, text] = row as readonly unknown[];
  return (
    typeof name === 'string' &&
    VERDICTS.some((each) => each === verdict) &&
    typeof moment === 'number' &&
    Number.isFinite(moment) &&
    (text === undefined || typeof text === 'string')
  );
}

export function writeKept(storage: Pick<Storage, 'setItem'>, kept: Kept): void {
  const acknowledged = [...kept.acknowledged].map(([id, { verdict, at }]) => [id, verdict, at]);
  const shelved = [...kept.shelved].map(([what, { verdict, until, reason }]) => [
    what,
    verdict,
    until,
    reason,
  ]);
  const { sound, notify } = kept;
  try {
    storage.setItem(KEY, JSON.stringify({ acknowledged, shelved, sound, notify }));
  } catch {
    // Storage is full or forbidden: it then lasts as long as the page.
  }
}

export const own = createStore<Kept>(NOTHING_KEPT);

/** For so long the last action can be undone where it was done, ms; later in the list. */
export const UNDO_MS = 10_000;

/** What the operator has just done. */
export interface Done {
  readonly what: 'acknowledge' | 'unacknowledge' | 'shelve' | 'unshelve';
  /** Alarms that it was done to. */
  readonly count: number;
  /** What was kept before. */
  readonly before: Kept;
}

/** The last action, as long as it can be undone; null: there is none. */
export const done = createStore<Done | null>(null);

/** Told of what is done here, with what was kept before and after; null: it stays here. */
export const acting: { tell: ((before: Kept, next: Kept) => void) | null } = { tell: null };

let timer: ReturnType<typeof setTimeout> | undefined;

function setDone(action: Done | null): void {
  clearTimeout(timer);
  done.set(action);
  if (action) timer = setTimeout(setDone, UNDO_MS, null);
}

function change(what: Done['what'], count: number, next: Kept): void {
  const before = own.get();
  own.set(next);
  setDone({ what, count, before });
  acting.tell?.(before, next);
}

export const acknowledgeAlarms = (items: readonly Rated[]): void => {
  change('acknowledge', items.length, acknowledge(own.get(), items, timeOfDay()));
};

export const unacknowledgeAlarm = (alarm: Alarm): void => {
  change('unacknowledge', 1, unacknowledge(own.get(), alarm));
};

export const shelveAlarm = (item: Rated, minutes: number, reason: string): void => {
  change('shelve', 1, shelve(own.get(), item, timeOfDay() + minutes * 60_000, reason));
};

export const unshelveAlarm = (alarm: Alarm): void => {
  change('unshelve', 1, unshelve(own.get(), alarm));
};

/** Takes the last action back. */
export function undo(): void {
  const last = done.get();
  if (!last) return;
  const { acknowledged, shelved } = last.before;
  const now = own.get();
  own.set({ ...now, acknowledged, shelved });
  setDone(null);
  acting.tell?.(now, own.get());
}

export const preferTold = (way: Partial<Pick<Kept, 'sound' | 'notify'>>): void => {
  own.set({ ...own.get(), ...way });
};

/** Takes what was kept, and keeps what is done from now on; returns the way to stop. */
export function startOwn(storage: Pick<Storage, 'getItem' | 'setItem'>): () => void {
  own.set(readKept(storage));
  const stop = own.subscribe(() => {
    writeKept(storage, own.get());
  });
  // Another tab has kept something: to undo what was done here would undo that as well.
  const onStorage = ({ key }: StorageEvent): void => {
    if (!isKept(key)) return;
    own.set(readKept(storage));
    setDone(null);
  };
  window.addEventListener('storage', onStorage);
  return () => {
    stop();
    setDone(null);
    window.removeEventListener('storage', onStorage);
  };
}
