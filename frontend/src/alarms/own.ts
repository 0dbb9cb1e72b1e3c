/** What this browser keeps about alarms, while the page is open: every tab of it has the same. */
import { timeOfDay } from '../clock';
import type { Alarm } from '../contract/types';
import { createStore } from '../store/create';
import {
  acknowledge,
  isKept,
  NOTHING_KEPT,
  readKept,
  shelve,
  unacknowledge,
  unshelve,
  writeKept,
  type Kept,
  type Rated,
} from './kept';

export const own = createStore<Kept, Kept>(NOTHING_KEPT, (_, next) => next);

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
export const done = createStore<Done | null, Done | null>(null, (_, next) => next);

/** Told of what is done here, with what was kept before and after; null: it stays here. */
export const acting: { tell: ((before: Kept, next: Kept) => void) | null } = { tell: null };

let timer: ReturnType<typeof setTimeout> | undefined;

function setDone(action: Done | null): void {
  clearTimeout(timer);
  done.dispatch(action);
  if (action) timer = setTimeout(setDone, UNDO_MS, null);
}

function change(what: Done['what'], count: number, next: Kept): void {
  const before = own.get();
  own.dispatch(next);
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
  own.dispatch({ ...now, acknowledged, shelved });
  setDone(null);
  acting.tell?.(now, own.get());
}

export const preferTold = (way: Partial<Pick<Kept, 'sound' | 'notify'>>): void => {
  own.dispatch({ ...own.get(), ...way });
};

/** Takes what was kept, and keeps what is done from now on; returns the way to stop. */
export function startOwn(storage: Pick<Storage, 'getItem' | 'setItem'>): () => void {
  own.dispatch(readKept(storage));
  const stop = own.subscribe(() => {
    writeKept(storage, own.get());
  });
  // Another tab has kept something: to undo what was done here would undo that as well.
  const onStorage = ({ key }: StorageEvent): void => {
    if (!isKept(key)) return;
    own.dispatch(readKept(storage));
    setDone(null);
  };
  window.addEventListener('storage', onStorage);
  return () => {
    stop();
    setDone(null);
    window.removeEventListener('storage', onStorage);
  };
}
