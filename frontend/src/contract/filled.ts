/**
 * What the server leaves out of tags and verdicts because it is as usual, put back. Here alone:
 * behind it every field is there, and each reading has its own age.
 */
import type { components } from './openapi.gen';
import { secondsBetween } from './time';
import type { Judgement, TwinTagState } from './types';

type Schemas = components['schemas'];
type WireTag = Schemas['TwinTagState'];

export function filledTag(tag: WireTag): TwinTagState {
  const { last_observed: last, stale_seconds: stale } = tag;
  let observedAt: WireTag['readings'][number]['observed_at'] = last;
  const readings = tag.readings.map((reading) => {
    if (reading.observed_at !== undefined) observedAt = reading.observed_at;
    const age = stale === null || !observedAt ? null : stale + secondsBetween(observedAt, last);
    return { ...reading, observed_at: observedAt ?? null, stale_seconds: age };
  });
  return {
    looked_at: null,
    last_try: last,
    last_try_status: 0,
    last_try_detail: '',
    ...tag,
    readings,
  };
}

export const filledHealth = ({ house, tags }: Schemas['Judgement']): Judgement => ({
  house: { reasons: [], ...house },
  tags: Object.fromEntries(Object.entries(tags).map(([id, tag]) => [id, { reasons: [], ...tag }])),
});
