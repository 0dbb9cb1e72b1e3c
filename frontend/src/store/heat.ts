/** Fetches what the heat map is made of: the nearest readings, or the estimate that was chosen. */
import { now } from '../clock';
import { fetchField, Refusal, type FieldQuery } from '../contract/api';
import type { Field, NoEstimate } from '../contract/types';

/** The estimate and its error come in one. */
export type Source = 'nearest' | 'estimate';

/** A twin that has refused an estimate is asked again after this long, ms. */
const CALM_MS = 10_000;
const TOO_MANY_REQUESTS = 429;

let refused: { readonly sensor: string; readonly why: NoEstimate; readonly until: number } | null =
  null;

/** Where a twin has no estimate, the nearest readings, with the reason. */
export function fetchHeat(source: Source, query: FieldQuery, signal: AbortSignal): Promise<Field> {
  if (source === 'nearest') return fetchField(query, signal);
  if (refused?.sensor === query.sensor && now() < refused.until) {
    return inPlace(refused.why, query, signal);
  }
  return import('./estimated').then(({ fetchEstimated }) =>
    fetchEstimated(query, signal).then(
      (field) => {
        refused = null;
        return field;
      },
      (error: unknown) => {
        // Whoever asks too much is not to ask once more.
        if (!(error instanceof Refusal) || error.status === TOO_MANY_REQUESTS) throw error;
        const why = { status: error.status, message: error.message };
        refused = { sensor: query.sensor, why, until: now() + CALM_MS };
        return inPlace(why, query, signal);
      },
    ),
  );
}

const inPlace = (noEstimate: NoEstimate, query: FieldQuery, signal: AbortSignal): Promise<Field> =>
  fetchField(query, signal).then((field) => ({ ...field, noEstimate }));
