/** What the robot has said, checked; how old it is by the twin's time; where it has been. */
import { useEffect, useState } from 'react';

import { checkOf } from '../contract/check';
import { fetchRobot } from '../contract/robot';
import type { Unread } from '../contract/frames';
import type { Robot, RobotNow, WireTime } from '../contract/types';
import { ageSeconds } from '../domain/age';
import { secondsOf } from '../domain/rostime';
import { receive, useApp, type AppState } from '../store/app';
import { useSelected } from '../store/create';
import { createFetcher } from '../store/fetcher';
import { memoOne } from '../store/memo';
import { rosNow, selectShown } from '../store/moment';
import { robotFrame } from '../store/signals';
import { extended, trailPoint, type TrailPoint } from './path';

const NOTHING: RobotNow = { position: null, plan: null, battery: null };

interface Checked {
  readonly robot: RobotNow;
  /** Why the frame is not shown. */
  readonly fault: string | null;
}

const read = memoOne((frame: Unread): Checked => {
  const fault = checkOf('RobotFrame')(frame);
  return { robot: fault === null ? (frame as Unread & RobotNow) : NOTHING, fault };
});
const NOT_YET: Checked = { robot: NOTHING, fault: null };
const checked = (frame: Unread | null): Checked => (frame ? read(frame) : NOT_YET);

/** What it says of itself; nothing of a frame that is none. */
export const useRobot = (): RobotNow => useSelected(robotFrame, (frame) => checked(frame).robot);

/** Tells of a frame that is none, until there is a better one. */
export function useFault(): void {
  const fault = useSelected(robotFrame, (frame) => checked(frame).fault);
  useEffect(() => {
    if (fault === null) return undefined;
    receive({ type: 'unread', why: `robot${fault}` });
    return () => {
      receive({ type: 'unread', why: null });
    };
  }, [fault]);
}

/** The twin's time, ROS seconds; null where no age is known. */
export const timeOf = (state: AppState, now: number): number | null =>
  selectShown(state).ageing.kind === 'unknown' ? null : rosNow(state, now);

/** How long ago that was, s; null: nobody knows. */
export function ageOf(stamp: WireTime, time: number | null): number | null {
  const at = secondsOf(stamp);
  return time === null || at === 0 ? null : ageSeconds(at * 1_000, time * 1_000);
}

/** Between two tries to get the trail, ms. */
const PACE_MS = 5_000;

/** Where the robot has been: as the bridge has it, and what was heard since. */
export function useTrail(): readonly TrailPoint[] {
  const isOpen = useApp((state) => state.twin.connection.socket.kind === 'open');
  const [trail, setTrail] = useState<readonly TrailPoint[]>([]);
  useEffect(() => {
    if (!isOpen) return undefined;
    const fetcher = createFetcher<Robot>({
      paceMs: PACE_MS,
      onValue: (robot) => {
        setTrail(robot.trail.map(trailPoint));
      },
      // It is asked for again; until then there is what was heard.
      onError: () => undefined,
    });
    fetcher.want({ key: 'robot', group: 'robot', run: fetchRobot });
    return () => {
      fetcher.want(null);
    };
  }, [isOpen]);
  useEffect(
    () =>
      robotFrame.subscribe(() => {
        const { position } = checked(robotFrame.get()).robot;
        if (position) setTrail((last) => extended(last, position));
      }),
    [],
  );
  return trail;
}
