/** Small stores beside the page's state. */
import type { RobotFrame, Session } from '../contract/types';
import { createStore, type Store } from './create';

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
export interface PointedTime {
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
