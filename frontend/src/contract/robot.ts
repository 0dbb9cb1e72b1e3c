/** What a robot says of itself: read where it is shown, and checked there to the last field. */
import { get, read } from './api';
import { list, number, numberOrNull, object, orNull } from './check';
import { TIME } from './shapes';
import type { Robot } from './types';

/** More than the bridge sends. */
const MOST_POINTS = 5_000;

const POINT = { x: number, y: number, observed_at: TIME };
const NOW = {
  position: orNull(object({ ...POINT, heading: numberOrNull })),
  plan: orNull(object({ points: list(list(number, 2), MOST_POINTS), observed_at: TIME })),
  battery: orNull(object({ percent: number, observed_at: TIME })),
};

/** Why a frame is none of a robot; null: it is one. */
export const ROBOT_FRAME = object(NOW);
const ROBOT = object({ ...NOW, trail: list(object(POINT), MOST_POINTS) });

export async function fetchRobot(signal: AbortSignal): Promise<Robot> {
  return read<Robot>('robot', ROBOT, await get('api/robot', signal));
}
