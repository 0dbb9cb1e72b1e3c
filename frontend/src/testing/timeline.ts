import type { Timeline as WireTimeline } from '../contract/types';
import { type Point, readingAt, type Series } from '../domain/series';
import type { Span } from '../domain/time';
import type { Timeline } from '../domain/timeline';

/** A hundred seconds without events, except the given ones. */
export const timelineWith = (over: Partial<Timeline>): Timeline => ({
  from: 100,
  to: 200,
  bucket_s: 1,
  ...{ reach: { from: 100, to: 200 }, complete_to: 200, kept_from: 100 },
  buckets: [],
  silences: [],
  runs: [],
  missing: [],
  ...over,
});

export const wireTimeline = ({
  from,
  to,
  ...over
}: Span & Partial<WireTimeline>): WireTimeline => ({
  ...{ from, to, bucket_s: (to - from) / 240, reach: { from, to } },
  ...{ buckets: [], silences: [], runs: [], complete_to: to, kept_from: from },
  ...over,
});

interface Given extends Partial<Series> {
  readonly readings?: readonly { readonly at: number; readonly value: number | null }[];
}

/** A hundred seconds without readings, except the given ones. */
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
