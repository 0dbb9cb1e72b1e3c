/**
 * Where what the twin observed comes from, as it says. A simulation is told as such; a recording that
 * is played is, in nothing, of now.
 */
import type { StatusFrame } from '../contract/types';
import { DAY_S } from '../domain/difference';
import { secondsOf } from '../domain/rostime';
import type { AppState } from './app';
import { isHeardNow, rosNow, selectNewest } from './moment';

/** Those that have to be told; null: a robot's, or of a twin that does not say. */
export type Origin = Exclude<StatusFrame['origin'], 'robot' | 'unknown'> | null;

export function selectOrigin({ twin }: AppState): Origin {
  const origin = twin.connection.status?.origin;
  return origin === 'simulated' || origin === 'recorded' || origin === 'sim_time' ? origin : null;
}

/** How long a day of the greenhouse takes, seconds of its time: in a demo it is a short one. */
export const selectDayS = ({ twin }: AppState): number =>
  twin.connection.status?.day_length_s ?? DAY_S;

export const selectIsRecorded = (state: AppState): boolean => selectOrigin(state) === 'recorded';

/** Whether the twin's time may be another than that of the clock on the wall. */
export const selectHasOwnTime = (state: AppState): boolean =>
  selectIsRecorded(state) || selectOrigin(state) === 'sim_time';

/** The newest moment there is where that is not the time on the wall, ROS seconds; else null. */
export function ownTime(state: AppState, at: number): number | null {
  if (!selectHasOwnTime(state)) return null;
  const { snapshot } = selectNewest(state);
  if (!snapshot) return null;
  const taken = secondsOf(snapshot.at);
  if (taken === 0) return null;
  return isHeardNow(state) ? rosNow(state, at) : taken;
}
