import { useSyncExternalStore } from 'react';

import type { RobotFrame, Session } from '../contract/types';
import { withParts } from '../domain/memo';

export interface Store<State> {
  readonly get: () => State;
  readonly set: (next: State) => void;
  readonly subscribe: (listener: () => void) => () => void;
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
          // One that fails keeps the news from nobody else; the browser tells of it.
          queueMicrotask(() => {
            throw error;
          });
        }
      }
    },
    subscribe: (listener) => {
      listeners.add(listener);
      return () => listeners.delete(listener);
    },
  };
}

/** Parts that are to be others, or what makes them of those that are there. */
export type Change<State> = Partial<State> | ((state: State) => Partial<State>);

/** The very same state where nothing in it is another. */
export const changed = <State extends object>(state: State, change: Change<State>): State =>
  withParts(state, typeof change === 'function' ? change(state) : change);

/** All of a store, or what `select` picks, which must be the same thing for the same state. */
export function useSelected<State>(store: Store<State>): State;
export function useSelected<State, Part>(store: Store<State>, select: (state: State) => Part): Part;
export function useSelected<State>(
  store: Store<State>,
  select: (state: State) => unknown = (state) => state,
): unknown {
  return useSyncExternalStore(store.subscribe, () => select(store.get()));
}

/** What a screen reader is told beside what it is led to. */
export interface Announcement {
  readonly text: string;
  /** Another one each time: the same words said again are news too. */
  readonly key: number;
}

export const createVoice = (): Store<Announcement> => createStore({ text: '', key: 0 });

export const announce = (voice: Store<Announcement>, text: string): void => {
  voice.set({ text, key: voice.get().key + 1 });
};

/** Who is signed in; null: not known yet. */
export const person = createStore<Session | null>(null);

/** Where people sign in, who may write notes acknowledges and shelves; else each browser for itself. */
export const mayAct = (who: Session | null): boolean => who?.can_write_notes ?? true;

/** The time that the mouse is on: in a chart, or on the time bar; each shows the other's. */
interface PointedTime {
  /** ROS seconds. */
  readonly at: number;
  readonly by: 'chart' | 'bar';
}

export const pointedTime = createStore<PointedTime | null>(null);

/** What the other of the two points at, ROS seconds. */
export const pointedBy =
  (by: PointedTime['by']) =>
  (pointed: PointedTime | null): number | null =>
    pointed?.by === by ? pointed.at : null;

/** The newest frame of a robot; null: none has come. */
export const robotFrame = createStore<RobotFrame | null>(null);
