/** What the robot has said; how old it is by the twin's time; where it has been. */
import { useEffect, useState } from 'react';

import { fetchRobot } from '../contract/robot';
import type { Robot, RobotNow, WireTime } from '../contract/types';
import { ageSeconds } from '../domain/age';
import { secondsOf } from '../domain/rostime';
import { useApp, type AppState } from '../store/app';
import { useSelected } from '../store/create';
import { createFetcher } from '../store/fetcher';
import { rosNow, selectShown } from '../store/moment';
import { robotFrame } from '../store/signals';
import { extended, trailPoint, type TrailPoint } from './path';

const NOTHING: RobotNow = { position: null, plan: null, battery: null };

/** What it says of itself. */
export const useRobot = (): RobotNow => useSelected(robotFrame, (frame) => frame ?? NOTHING);

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
        const position = robotFrame.get()?.position;
        if (position) setTrail((last) => extended(last, position));
      }),
    [],
  );
  return trail;
}
