/**
 * This browser's alarm state, shared by its tabs: acknowledged and shelved alarms, and whether sound and
 * notifications are on. For a signed-in user, `people.ts` also sends actions to the bridge. Times are ms
 * since the epoch.
 */
import { timeOfDay } from '../clock';
import type { Alarm, Verdict } from '../contract/types';
import { isOfRange, sideOf, VERDICTS } from '../domain/health';
import { createStore } from '../store/create';

/** An acknowledgement of an alarm no longer listed is deleted after this long, ms. */
export const FORGET_MS = 7 * 86_400_000;
/** How long an alarm can be shelved, minutes; a critical one for less. */
export const shelfMinutes = (verdict: Verdict): readonly number[] =>
  verdict === 'critical' ? [15, 60] : [15, 60, 480];

/** Longest shelf time, ms. */
const longestShelfMs = (verdict: Verdict): number => Math.max(...shelfMinutes(verdict)) * 60_000;

/** Longest reason, characters. */
export const LONGEST_REASON = 120;

/** Shelving a critical alarm needs a reason, so that it is deliberate. */
export const needsReason = (verdict: Verdict): boolean => verdict === 'critical';

interface Acknowledgement {
  /** The alarm's verdict when acknowledged. */
  readonly verdict: Verdict;
  /** Time of the acknowledgement. */
  readonly at: number;
}

export interface Shelf {
  /** The alarm's verdict when shelved. */
  readonly verdict: Verdict;
  readonly until: number;
  /** The operator's own words; may be empty. */
  readonly reason: string;
}

export interface Kept {
  /** By alarm id. */
  readonly acknowledged: ReadonlyMap<string, Acknowledgement>;
  /** By `whatOf`, so that the shelf still holds if the alarm is raised again. */
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

/** Key of what is wrong and where, independent of time; "too cold" and "too warm" differ. */
export const whatOf = ({ tag_id, reason }: Pick<Alarm, 'tag_id' | 'reason'>): string =>
  JSON.stringify([tag_id, reason.kind, reason.sensor, isOfRange(reason) ? sideOf(reason) : '']);

/** An alarm and its current verdict. */
export interface Rated {
  readonly alarm: Alarm;
  readonly verdict: Verdict;
}

export const acknowledge = (kept: Kept, alarms: readonly Rated[], at: number): Kept => ({
  ...kept,
  acknowledged: new Map([
    ...kept.acknowledged,
    ...alarms.map(({ alarm, verdict }) => [alarm.id, { verdict, at }] as const),
  ]),
});

export const shelve = (
  kept: Kept,
  { alarm, verdict }: Rated,
  until: number,
  reason: string,
): Kept => ({
  ...kept,
  shelved: new Map([...kept.shelved, [whatOf(alarm), { verdict, until, reason }]]),
});

const without = <Value>(map: ReadonlyMap<string, Value>, key: string): ReadonlyMap<string, Value> =>
  new Map([...map].filter(([each]) => each !== key));

/** `kept` without ended shelves and old acknowledgements of unlisted alarms; null: not known what is listed. */
export function pruned(kept: Kept, listed: ReadonlySet<string> | null, at: number): Kept {
  const acknowledged = [...kept.acknowledged].filter(
    ([id, each]) => !listed || listed.has(id) || Math.abs(at - each.at) < FORGET_MS,
  );
  const shelved = [...kept.shelved].filter(([, shelf]) => isAhead(shelf, at));
  const isSame =
    acknowledged.length === kept.acknowledged.size && shelved.length === kept.shelved.size;
  return isSame
    ? kept
    : { ...kept, acknowledged: new Map(acknowledged), shelved: new Map(shelved) };
}

/** Whether a shelf is still running; the upper limit ends it if the clock is set back. */
const isAhead = ({ verdict, until }: Shelf, at: number): boolean =>
  until > at && until - at <= longestShelfMs(verdict);

export const isShelfHeld = (shelf: Shelf, verdict: Verdict, at: number): boolean =>
  isAhead(shelf, at) && !isWorse(verdict, shelf.verdict);

/** When the next shelf ends; Infinity: there is none. */
export const nextEnd = (kept: Kept, at: number): number =>
  Math.min(...[...kept.shelved.values()].map(({ until }) => until).filter((until) => until > at));

const KEY = 'lupin-twin.alarms';
/** Reads the stored state; a damaged one counts as empty. */
export function readKept(storage: Pick<Storage, 'getItem'>): Kept {
  try {
    const {
      acknowledged = [],
      shelved = [],
      sound = false,
      notify = false,
    } = JSON.parse(storage.getItem(KEY) ?? '{}') as Partial<KeptRows>;
    return {
      acknowledged: new Map(acknowledged.map(([id, verdict, at]) => [id, { verdict, at }])),
      shelved: new Map(
        shelved.map(([what, verdict, until, reason = '']) => [what, { verdict, until, reason }]),
      ),
      ...{ sound, notify },
    };
  } catch {
    return NOTHING_KEPT;
  }
}

/** Stored form of `Kept`. */
interface KeptRows {
  readonly acknowledged: readonly (readonly [id: string, Verdict, at: number])[];
  readonly shelved: readonly (readonly [what: string, Verdict, until: number, reason?: string])[];
  readonly sound: boolean;
  readonly notify: boolean;
}

export function writeKept(storage: Pick<Storage, 'setItem'>, kept: Kept): void {
  const { sound, notify } = kept;
  const rows: KeptRows = {
    acknowledged: [...kept.acknowledged].map(([id, { verdict, at }]) => [id, verdict, at]),
    shelved: [...kept.shelved].map(([what, { verdict, until, reason }]) => [
      what,
      verdict,
      until,
      reason,
    ]),
    ...{ sound, notify },
  };
  try {
    storage.setItem(KEY, JSON.stringify(rows));
  } catch {
    // Storage is full or blocked: the state then lasts as long as the page.
  }
}

export const own = createStore<Kept>(NOTHING_KEPT);

/** How long the last action can be undone in place, ms; later, through the alarm's menu. */
export const UNDO_MS = 10_000;

/** The operator's last action. */
export interface Done {
  readonly what: 'acknowledge' | 'unacknowledge' | 'shelve' | 'unshelve';
  /** Number of alarms affected. */
  readonly count: number;
  /** State before the action. */
  readonly before: Kept;
}

/** The last action while it can be undone; null: none. */
export const done = createStore<Done | null>(null);

/** Called with the state before and after each action, to share it; null: it stays in this browser. */
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
  const kept = own.get();
  change('unacknowledge', 1, { ...kept, acknowledged: without(kept.acknowledged, alarm.id) });
};

export const shelveAlarm = (item: Rated, minutes: number, reason: string): void => {
  change('shelve', 1, shelve(own.get(), item, timeOfDay() + minutes * 60_000, reason));
};

export const unshelveAlarm = (alarm: Alarm): void => {
  const kept = own.get();
  change('unshelve', 1, { ...kept, shelved: without(kept.shelved, whatOf(alarm)) });
};

/** Undoes the last action. */
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

/** Loads the stored state, and stores every change; returns a stop function. */
export function startOwn(storage: Pick<Storage, 'getItem' | 'setItem'>): () => void {
  own.set(readKept(storage));
  const stop = own.subscribe(() => {
    writeKept(storage, own.get());
  });
  // Another tab changed the state: undoing here would undo its change too.
  const onStorage = ({ key }: StorageEvent): void => {
    if (key !== KEY && key !== null) return;
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
