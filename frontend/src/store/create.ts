import { useSyncExternalStore } from 'react';

import type { RobotFrame, Session } from '../contract/types';
import { withParts } from '../domain/memo';
import type { Box } from '../geometry/coordinates';

/** Never aborts: for what lasts as long as the page. */
export const PAGE = new AbortController().signal;

export interface Store<State> {
  readonly get: () => State;
  readonly set: (next: State) => void;
  /** Until the signal aborts, or the returned function is called. */
  readonly subscribe: (listener: () => void, signal?: AbortSignal) => () => void;
}

export function createStore<State>(initial: State): Store<State> {
  let state = initial;
  const listeners = new Set<() => void>();
  return {
    get: () => state,
    set: (next) => {
      if (next === state) return;
      state = next;
      for (const listener of [...listeners]) {
        try {
          listener();
        } catch (error) {
          // A failing listener must not stop the others; the browser reports it.
          queueMicrotask(() => {
            throw error;
          });
        }
      }
    },
    subscribe: (listener, signal) => {
      const stop = (): void => void listeners.delete(listener);
      listeners.add(listener);
      signal?.addEventListener('abort', stop);
      return stop;
    },
  };
}

/** Changed parts, or a function that computes them from the current state. */
export type Change<State> = Partial<State> | ((state: State) => Partial<State>);

/** The same object if nothing in it changes. */
export const changed = <State extends object>(state: State, change: Change<State>): State =>
  withParts(state, typeof change === 'function' ? change(state) : change);

/** All of a store, or what `select` picks; the same state must give the same object. */
export const useSelected = <State, Part = State>(
  store: Store<State>,
  select = (state: State) => state as unknown as Part,
): Part => useSyncExternalStore(store.subscribe, () => select(store.get()));

/** What a screen reader announces beside the focused element. */
export interface Announcement {
  readonly text: string;
  /** A new number each time: repeated words are announced again. */
  readonly key: number;
}

export const createVoice = (): Store<Announcement> => createStore({ text: '', key: 0 });

export const announce = (voice: Store<Announcement>, text: string): void => {
  voice.set({ text, key: voice.get().key + 1 });
};

/** The session, with who is signed in, if people sign in here; null: not known yet. */
export const person = createStore<Session | null>(null);

/** With sign-in, users who may write notes acknowledge and shelve; otherwise each browser for itself. */
export const mayAct = (who: Session | null): boolean => !who?.name || who.can_write_notes;

/** A note is withdrawn by who wrote it, or by an admin. */
export const mayWithdraw = (who: Session | null, by: string | null): boolean =>
  who?.can_write_notes === true && (by === who.name || who.role === 'admin');

/** The time under the mouse, in a chart or on the time bar, ROS seconds; each shows the other's. */
export const pointedTime = createStore<number | null>(null);

/** The robot's latest frame; null: none received. */
export const robotFrame = createStore<RobotFrame | null>(null);

/** Marks that labels keep clear of, pixels relative to the map's origin. */
export const marksOnMap = createStore<readonly Box[]>([]);

/** Keeps labels off these marks until the returned function is called. */
export function keepClear(marks: readonly Box[]): () => void {
  marksOnMap.set([...marksOnMap.get(), ...marks]);
  return () => marksOnMap.set(marksOnMap.get().filter((each) => !marks.includes(each)));
}
