import { useSyncExternalStore } from 'react';

import type { RobotFrame, Session } from '../contract/types';

export interface Store<State, Action> {
  readonly get: () => State;
  readonly dispatch: (action: Action) => void;
  /** Calls back after every change; returns the way to stop. */
  readonly subscribe: (listener: () => void) => () => void;
}

export function createStore<State, Action>(
  initial: State,
  reduce: (state: State, action: Action) => State,
): Store<State, Action> {
  let state = initial;
  const listeners = new Set<() => void>();
  return {
    get: () => state,
    dispatch: (action) => {
      const next = reduce(state, action);
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

/** The part of the state that `select` picks; it must return the same thing for the same state. */
export function useSelected<State, Action, Part>(
  store: Store<State, Action>,
  select: (state: State) => Part,
): Part {
  return useSyncExternalStore(store.subscribe, () => select(store.get()));
}

/** What a screen reader is told beside what it is led to. */
export interface Announcement {
  readonly text: string;
  /** Another one each time: the same words said again are news too. */
  readonly key: number;
}

/** A voice of its own, silent at first. */
export const createVoice = (): Store<Announcement, string> =>
  createStore({ text: '', key: 0 }, ({ key }: Announcement, text: string) => ({
    text,
    key: key + 1,
  }));

/** Who is signed in; null: not known yet. */
export const person = createStore<Session | null, Session | null>(null, (_, next) => next);

/** Where people sign in, who may write notes acknowledges and shelves; else each browser for itself. */
export const mayAct = (who: Session | null): boolean => who?.can_write_notes ?? true;

/** The time that the mouse is on: in a chart, or on the time bar; each shows the other's. */
interface PointedTime {
  /** ROS seconds. */
  readonly at: number;
  readonly by: 'chart' | 'bar';
}

/** Null: it is on none. */
export const pointedTime = createStore<PointedTime | null, PointedTime | null>(
  null,
  (_, pointed) => pointed,
);

/** What the other of the two points at, ROS seconds. */
export const pointedBy =
  (by: PointedTime['by']) =>
  (pointed: PointedTime | null): number | null =>
    pointed?.by === by ? pointed.at : null;

/** The newest frame of a robot; null: none has come. */
export const robotFrame = createStore<RobotFrame | null, RobotFrame | null>(
  null,
  (_, frame) => frame,
);
