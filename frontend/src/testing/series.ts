/** What there is to draw a line of. */
import type { Series } from '../domain/series';

/** A hundred seconds without a reading, but for what is told otherwise. */
export const seriesWith = (over: Partial<Series> = {}): Series => ({
  tagId: '1',
  sensor: 'temperature',
  from: 0,
  to: 100,
  bucketS: null,
  readings: [],
  buckets: [],
  gaps: [],
  nights: null,
  missing: [],
  ...over,
});
