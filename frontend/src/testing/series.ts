/** What there is to draw a line of. */
import { type Point, readingAt, type Series } from '../domain/series';

interface Given extends Partial<Series> {
  readonly readings?: readonly { readonly at: number; readonly value: number | null }[];
}

/** A hundred seconds without a reading, but for what is told otherwise. */
export const seriesWith = ({ readings = [], ...over }: Given = {}): Series => ({
  tagId: '1',
  sensor: 'temperature',
  from: 0,
  to: 100,
  bucketS: null,
  points: readings.map(({ at, value }) => readingAt(at, value)),
  gaps: [],
  nights: null,
  missing: [],
  ...over,
});

export const bucketAt = (at: number, value: number, n = 10, spread = 1): Point => ({
  ...{ at, value, n, min: value - spread, max: value + spread },
});
