/** What comes behind the first view at three places of it; of a robot only where there is one. */
import type { JSX } from 'react';

import type * as RobotParts from '../robot/parts';
import { useApp } from '../store/app';
import { robotFrame, useSelected } from '../store/create';
import { selectShown } from '../store/moment';
import { HoverCard } from './HoverCard';
import { inTime } from './inTime';
import { Keys } from './Keys';

const robot = (): Promise<typeof RobotParts> => import('../robot/parts');
const RobotLayer = inTime(async () => (await robot()).RobotLayer);
const RobotFact = inTime(async () => (await robot()).RobotFact);
const RobotChoice = inTime(async () => (await robot()).RobotChoice);

const useHasRobot = (): boolean => useSelected(robotFrame, (frame) => frame !== null);

/** A robot is of now: whoever looks back sees none. */
function useRobot(): boolean {
  const isShown = useApp(
    (state) => state.view.layers.has('robot') && selectShown(state).moment === null,
  );
  return useHasRobot() && isShown;
}

export const OnMap = (): JSX.Element => (
  <>
    {useRobot() && <RobotLayer />}
    <HoverCard />
  </>
);

export const InLegend = (): JSX.Element => (
  <>
    {useRobot() && <RobotFact />}
    <Keys />
  </>
);

export const InLayers = (): JSX.Element | null => (useHasRobot() ? <RobotChoice /> : null);
