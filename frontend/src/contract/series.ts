/** The route of one sensor's past, and the address of the same as rows to take away. */
import { get, read, route } from './api';
import { momentParameter } from './past';
import type { History } from './types';

/** What the server gives at most of each. */
const MAX_POINTS = 5_000;

/** Times are ROS seconds. */
export interface SeriesQuery {
  readonly tagId: string;
  readonly sensor: string;
  readonly from: number;
  readonly to: number;
  readonly points: number;
}

export async function fetchSeries(query: SeriesQuery, signal: AbortSignal): Promise<History> {
  const parts = new URLSearchParams({
    tag_id: query.tagId,
    sensor_type: query.sensor,
    from: momentParameter(query.from),
    to: momentParameter(query.to),
    points: String(Math.min(MAX_POINTS, query.points)),
  });
  const response = await get(`api/history?${parts.toString()}`, signal);
  return read('History', response);
}

/** Where every reading and try of a period is to be had, of one tag and of one sensor if named. */
export function exportAddress(query: {
  readonly from: number;
  readonly to: number;
  readonly tagId?: string | undefined;
  readonly sensor?: string | undefined;
}): string {
  const parts = new URLSearchParams({
    from: momentParameter(query.from),
    to: momentParameter(query.to),
  });
  if (query.tagId !== undefined) parts.set('tag_id', query.tagId);
  if (query.sensor !== undefined) parts.set('sensor_type', query.sensor);
  return route(`api/export.csv?${parts.toString()}`).href;
}
