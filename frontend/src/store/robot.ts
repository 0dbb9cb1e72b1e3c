/** The newest frame of a robot, as it came: what reads it is loaded once there is one. */
import type { Unread } from '../contract/frames';
import { createStore } from './create';

export const robotFrame = createStore<Unread | null, Unread | null>(null, (last, next) =>
  next === null || next.type === 'robot' ? next : last,
);
