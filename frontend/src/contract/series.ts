/** The route of one sensor's past, and the address of the same as rows to take away. */
import { answer, momentParameter, route, withQuery } from './api';
import type { History } from './types';

/** What the server gives at most of each. */
const MAX_POINTS = 5_000;

/** Times are ROS seconds. */
interface Asked {
  readonly tagId: string | undefined;
  readonly sensor: string | undefined;
  readonly from: number;
  readonly to: number;
}

const parameters = ({ tagId, sensor, from, to }: Asked) => ({
  tag_id: tagId,
  sensor_type: sensor,
  from: momentParameter(from),
  to: momentParameter(to),
});

export const fetchSeries = (asked: Asked, points: number, signal: AbortSignal): Promise<History> =>
  answer('History', signal, 'api/history', {
    ...parameters(asked),
    points: Math.min(MAX_POINTS, points),
  });

/** Where every reading and try of a period is to be had, of one tag and of one sensor if named. */
export const exportAddress = (asked: Asked): string =>
  route(withQuery('api/export.csv', parameters(asked))).href;
