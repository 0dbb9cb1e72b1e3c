/** The route of one sensor's past, and the address of the same as rows to take away. */
import { get, read, route } from './api';
import { boolean, count, list, number, numberOrNull, object, orNull } from './check';
import { TEXT, TIME } from './shapes';
import { momentParameter } from './past';
import type { History } from './types';

/** What the server gives at most of each. */
const MAX_POINTS = 5_000;

const STRETCH = object({ from: TIME, to: TIME });

export const SERIES = object({
  tag_id: TEXT,
  sensor_type: TEXT,
  unit: TEXT,
  from: TIME,
  to: TIME,
  is_bucketed: boolean,
  bucket_s: orNull(number),
  readings: list(object({ stamp: TIME, value: numberOrNull }), MAX_POINTS),
  buckets: list(
    object({ start: TIME, n: count, mean: number, min: number, max: number }),
    MAX_POINTS,
  ),
  gaps: list(STRETCH, MAX_POINTS + 1),
  nights: orNull(list(STRETCH, MAX_POINTS)),
  complete_to: orNull(TIME),
  kept_from: orNull(TIME),
});

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
  return read<History>('history', SERIES, response);
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
