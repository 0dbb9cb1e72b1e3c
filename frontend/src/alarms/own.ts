/** What this browser keeps about alarms, while the page is open: every tab of it has the same. */
import { timeOfDay } from '../clock';
import type { Alarm } from '../contract/types';
import { createStore } from '../store/create';
import {
  isKept,
  markSeen,
  NOTHING_KEPT,
  readKept,
  shelve,
  unshelve,
  writeKept,
  type Kept,
  type Rated,
} from './kept';

export const own = createStore<Kept, Kept>(NOTHING_KEPT, (_, next) => next);

export const seeAlarms = (items: readonly Rated[]): void => {
  own.dispatch(markSeen(own.get(), items, timeOfDay()));
};

export const shelveAlarm = (item: Rated, minutes: number): void => {
  own.dispatch(shelve(own.get(), item, timeOfDay() + minutes * 60_000));
};

export const unshelveAlarm = (alarm: Alarm): void => {
  own.dispatch(unshelve(own.get(), alarm));
};

export const preferTold = (way: Partial<Pick<Kept, 'sound' | 'notify'>>): void => {
  own.dispatch({ ...own.get(), ...way });
};

/** Takes what was kept, and keeps what is done from now on; returns the way to stop. */
export function startOwn(storage: Pick<Storage, 'getItem' | 'setItem'>): () => void {
  own.dispatch(readKept(storage));
  const stop = own.subscribe(() => {
    writeKept(storage, own.get());
  });
  // Another tab has kept something.
  const onStorage = ({ key }: StorageEvent): void => {
    if (isKept(key)) own.dispatch(readKept(storage));
  };
  window.addEventListener('storage', onStorage);
  return () => {
    stop();
    window.removeEventListener('storage', onStorage);
  };
}
