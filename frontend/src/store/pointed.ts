import { createStore } from './create';

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
