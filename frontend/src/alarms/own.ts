/**
 * This browser's alarm state, shared by its tabs: acknowledged and shelved alarms. For a signed-in user,
 * `people.ts` also sends actions to the bridge. Times are ms since the epoch.
 */
import { timeOfDay } from '../clock';
import type { Alarm, Verdict } from '../contract/types';
import { isOfRange, sideOf, VERDICTS } from '../domain/health';
import { createStore, PAGE } from '../store/create';
import { keepStored } from '../store/settings';

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

export interface LocalAlarms {
  /** By alarm id. */
  readonly acknowledged: ReadonlyMap<string, Acknowledgement>;
  /** By `faultKey`, so that the shelf still holds if the alarm is raised again. */
  readonly shelved: ReadonlyMap<string, Shelf>;
}

export const NO_LOCAL_ALARMS: LocalAlarms = { acknowledged: new Map(), shelved: new Map() };

/** Whether a verdict is worse than another. */
export const isWorse = (a: Verdict, b: Verdict): boolean =>
  VERDICTS.indexOf(a) < VERDICTS.indexOf(b);

/** Key of what is wrong and where, independent of time; "too cold" and "too warm" differ. */
export const faultKey = ({ tag_id, reason }: Pick<Alarm, 'tag_id' | 'reason'>): string =>
  JSON.stringify([tag_id, reason.kind, reason.sensor, isOfRange(reason) ? sideOf(reason) : '']);

interface WithAlarm {
  readonly alarm: Alarm;
}

export const acknowledge = (
  local: LocalAlarms,
  items: readonly WithAlarm[],
  at: number,
): LocalAlarms => ({
  ...local,
  acknowledged: new Map([
    ...local.acknowledged,
    ...items.map(({ alarm: { id, reason } }) => [id, { verdict: reason.verdict, at }] as const),
  ]),
});

export const shelve = (
  local: LocalAlarms,
  items: readonly WithAlarm[],
  until: number,
  reason: string,
): LocalAlarms => ({
  ...local,
  shelved: new Map([
    ...local.shelved,
    ...items.map(
      ({ alarm }) => [faultKey(alarm), { verdict: alarm.reason.verdict, until, reason }] as const,
    ),
  ]),
});

const without = <Value>(
  map: ReadonlyMap<string, Value>,
  keys: readonly string[],
): ReadonlyMap<string, Value> => new Map([...map].filter(([each]) => !keys.includes(each)));

/** `local` without ended shelves and old acknowledgements of unlisted alarms; null: not known what is listed. */
export function pruned(
  local: LocalAlarms,
  listed: ReadonlySet<string> | null,
  at: number,
): LocalAlarms {
  const acknowledged = [...local.acknowledged].filter(
    ([id, each]) => !listed || listed.has(id) || Math.abs(at - each.at) < FORGET_MS,
  );
  const shelved = [...local.shelved].filter(([, shelf]) => isAhead(shelf, at));
  const isSame =
    acknowledged.length === local.acknowledged.size && shelved.length === local.shelved.size;
  return isSame
    ? local
    : { ...local, acknowledged: new Map(acknowledged), shelved: new Map(shelved) };
}

/** Whether a shelf is still running; the upper limit ends it if the clock is set back. */
const isAhead = ({ verdict, until }: Shelf, at: number): boolean =>
  until > at && until - at <= longestShelfMs(verdict);

export const isShelfHeld = (shelf: Shelf, verdict: Verdict, at: number): boolean =>
  isAhead(shelf, at) && !isWorse(verdict, shelf.verdict);

/** When the next shelf ends; Infinity: there is none. */
export const nextEnd = (local: LocalAlarms, at: number): number =>
  Math.min(...[...local.shelved.values()].map(({ until }) => until).filter((until) => until > at));

const KEY = 'lupin-twin.alarms';

/** Maps as their entries. */
interface Stored {
  readonly acknowledged?: readonly (readonly [id: string, Acknowledgement])[];
  readonly shelved?: readonly (readonly [what: string, Shelf])[];
}

/** Reads the stored state; a damaged one counts as empty. */
export function readStored(storage: Pick<Storage, 'getItem'>): LocalAlarms {
  try {
    const stored = JSON.parse(storage.getItem(KEY) ?? '{}') as Stored;
    return { acknowledged: new Map(stored.acknowledged), shelved: new Map(stored.shelved) };
  } catch {
    return NO_LOCAL_ALARMS;
  }
}

export const writeStored = (
  storage: Pick<Storage, 'setItem'>,
  { acknowledged, shelved }: LocalAlarms,
): void => keepStored(storage, KEY, { acknowledged: [...acknowledged], shelved: [...shelved] });

export const own = createStore<LocalAlarms>(NO_LOCAL_ALARMS);

/** How long the last action can be undone in place, ms; later, through the alarm's menu. */
export const UNDO_MS = 10_000;

/** The operator's last action. */
interface LastAction {
  readonly what: 'acknowledge' | 'unacknowledge' | 'shelve' | 'unshelve';
  /** Number of alarms affected. */
  readonly count: number;
  /** State before and after the action. */
  readonly before: LocalAlarms;
  readonly after: LocalAlarms;
}

/** The last action while it can be undone; null: none. */
export const lastAction = createStore<LastAction | null>(null);

/** Called with the state before and after each action, to share it; null: it stays in this browser. */
export const acting: { share: ((before: LocalAlarms, next: LocalAlarms) => void) | null } = {
  share: null,
};

let timer: ReturnType<typeof setTimeout> | undefined;

function setLastAction(action: LastAction | null): void {
  clearTimeout(timer);
  lastAction.set(action);
  if (action) timer = setTimeout(setLastAction, UNDO_MS, null);
}

function change(
  what: LastAction['what'],
  items: readonly WithAlarm[],
  parts: Partial<LocalAlarms>,
): void {
  const before = own.get();
  const after = { ...before, ...parts };
  own.set(after);
  setLastAction({ what, count: items.length, before, after });
  acting.share?.(before, after);
}

export const acknowledgeAlarms = (items: readonly WithAlarm[]): void => {
  change('acknowledge', items, acknowledge(own.get(), items, timeOfDay()));
};

export const unacknowledgeAlarms = (items: readonly WithAlarm[]): void => {
  const ids = items.map(({ alarm }) => alarm.id);
  change('unacknowledge', items, { acknowledged: without(own.get().acknowledged, ids) });
};

export const shelveAlarms = (
  items: readonly WithAlarm[],
  minutes: number,
  reason: string,
): void => {
  change('shelve', items, shelve(own.get(), items, timeOfDay() + minutes * 60_000, reason));
};

export const unshelveAlarms = (items: readonly WithAlarm[]): void => {
  const faults = items.map(({ alarm }) => faultKey(alarm));
  change('unshelve', items, { shelved: without(own.get().shelved, faults) });
};

/** Undoes the last action. */
export function undo(): void {
  const last = lastAction.get();
  if (!last) return;
  own.set(last.before);
  setLastAction(null);
  acting.share?.(last.after, last.before);
}

/** Loads the stored state, and stores every change. */
export function startOwn(storage: Pick<Storage, 'getItem' | 'setItem'>, signal = PAGE): void {
  own.set(readStored(storage));
  own.subscribe(() => {
    writeStored(storage, own.get());
    // Another tab or person changed the state: undoing here would undo that too.
    if (lastAction.get()?.after !== own.get()) setLastAction(null);
  }, signal);
  const onStorage = ({ key }: StorageEvent): void => {
    if (key === KEY || key === null) own.set(readStored(storage));
  };
  window.addEventListener('storage', onStorage, { signal });
  signal.addEventListener('abort', () => setLastAction(null));
}
