/** Fetches the heat map's source: the nearest readings, or the chosen estimate. */
import { fetchEstimate, fetchField, Refusal, type FieldQuery } from '../contract/api';
import type { Field } from '../contract/types';
import { estimatedField, resolutionFor } from '../domain/field';
import { memoOne } from '../domain/memo';
import type { Snapshot, Tag } from '../domain/twin';
import { boundsOf, type Bounds, widened } from '../geometry/coordinates';
import type { Source } from './derived';

const TOO_MANY_REQUESTS = 429;

/** If the twin has no estimate, the nearest readings, with the reason. */
export async function fetchHeat(
  source: Source,
  query: FieldQuery,
  signal: AbortSignal,
): Promise<Field> {
  if (source === 'nearest') return fetchField(query, signal);
  try {
    return estimatedField(query.sensor, await fetchEstimate(query, signal));
  } catch (error) {
    // After 429, a second request would make it worse.
    if (!(error instanceof Refusal) || error.status === TOO_MANY_REQUESTS) throw error;
    return { ...(await fetchField(query, signal)), noEstimate: error.message };
  }
}

/** The server's box contains the pinned tags, widened by its max_distance_m. */
const ASSUMED_MARGIN_M = 1.5;
/** The page interpolates: more cells would only load the Wi-Fi. */
const MAX_CELLS = 20_000;
/** The server's default, used if no tag has a place. */
const DEFAULT_RESOLUTION_M = 0.1;

const boxOf = memoOne((tags: readonly Tag[]) => {
  const bounds = boundsOf(tags.flatMap(({ at }) => at ?? []));
  return bounds && widened(bounds, ASSUMED_MARGIN_M);
});

/** The extent of a field; null: nothing is pinned. */
export const boxOfPins = (snapshot: Snapshot | null): Bounds | null =>
  snapshot && boxOf(snapshot.tags);

/** Cell size, in metres, for the field of a greenhouse of this size. */
export function fieldResolution(snapshot: Snapshot | null): number {
  const box = boxOfPins(snapshot);
  return box ? resolutionFor(box, MAX_CELLS) : DEFAULT_RESOLUTION_M;
}
