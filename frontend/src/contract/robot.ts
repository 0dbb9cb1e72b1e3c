/** What a robot says of itself, and where it has been. */
import { get, read } from './api';
import type { Robot } from './types';

export async function fetchRobot(signal: AbortSignal): Promise<Robot> {
  return read('Robot', await get('api/robot', signal));
}
