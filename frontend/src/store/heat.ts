/** Fetches what the heat map is made of: the nearest readings, or the estimate that was chosen. */
import { now } from '../clock';
import { fetchEstimate, fetchField, Refusal, type FieldQuery } from '../contract/api';
import type { Field, NoEstimate } from '../contract/types';
import { estimatedField, resolutionFor } from '../domain/field';
import { memoOne } from '../domain/memo';
import type { Snapshot, Tag } from '../domain/twin';
import { boundsOf, type Bounds, widened } from '../geometry/coordinates';
import type { Source } from './derived';

/** A twin that has refused an estimate is asked again after this long, ms. */
const CALM_MS = 10_000;
const TOO_MANY_REQUESTS = 429;

let refused: { readonly sensor: string; readonly why: NoEstimate; readonly until: number } | null =
  null;

/** Where a twin has no estimate, the nearest readings, with the reason. */
export async function fetchHeat(
  source: Source,
  query: FieldQuery,
  signal: AbortSignal,
): Promise<Field> {
  if (source === 'nearest') return fetchField(query, signal);
  if (refused?.sensor === query.sensor && now() < refused.until) {
    return inPlace(refused.why, query, signal);
  }
  try {
    const estimate = await fetchEstimate(query, signal);
    refused = null;
    return estimatedField(query.sensor, estimate);
  } catch (error) {
    // Whoever asks too much is not to ask once more.
    if (!(error instanceof Refusal) || error.status === TOO_MANY_REQUESTS) throw error;
    const why = { status: error.status, message: error.message };
    refused = { sensor: query.sensor, why, until: now() + CALM_MS };
    return inPlace(why, query, signal);
  }
}

const inPlace = (noEstimate: NoEstimate, query: FieldQuery, signal: AbortSignal): Promise<Field> =>
  fetchField(query, signal).then((field) => ({ ...field, noEstimate }));

/** The server's box is that of the pinned tags widened by its max_distance_m. */
const ASSUMED_MARGIN_M = 1.5;
/** Finer cells than this cannot be told apart on a screen, and cost the Wi-Fi. */
const MAX_CELLS = 60_000;
/** As the server has it, where no tag has a place. */
const DEFAULT_RESOLUTION_M = 0.1;

const boxOf = memoOne((tags: readonly Tag[]) => {
  const bounds = boundsOf(tags.flatMap(({ at }) => at ?? []));
  return bounds && widened(bounds, ASSUMED_MARGIN_M);
});

/** As far as a field reaches; null: nothing is pinned. */
export const boxOfPins = (snapshot: Snapshot | null): Bounds | null =>
  snapshot && boxOf(snapshot.tags);

/** The side of a cell, in metres, for the field of a house as large as this one. */
export function fieldResolution(snapshot: Snapshot | null): number {
  const box = boxOfPins(snapshot);
  return box ? resolutionFor(box, MAX_CELLS) : DEFAULT_RESOLUTION_M;
}
