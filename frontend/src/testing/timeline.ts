/** A timeline, as the page has it and as the server writes it. */
import type { Timeline as WireTimeline, WireTime } from '../contract/types';
import type { Timeline } from '../domain/timeline';

/** A hundred seconds in which nothing happened, but for what is told otherwise. */
export const timelineWith = (over: Partial<Timeline>): Timeline => ({
  from: 100,
  to: 200,
  bucketS: 1,
  reach: { from: 100, to: 200 },
  buckets: [],
  silences: [],
  runs: [],
  missing: [],
  ...over,
});

export const wireTime = (seconds: number): WireTime => ({
  sec: Math.floor(seconds),
  nanosec: Math.round((seconds % 1) * 1e9),
});

export const wireStretch = (
  from: number,
  to: number,
): { readonly from: WireTime; readonly to: WireTime } => ({
  from: wireTime(from),
  to: wireTime(to),
});

export function wireTimeline({
  from,
  to,
  ...over
}: { from: number; to: number } & Partial<Omit<WireTimeline, 'from' | 'to'>>): WireTimeline {
  return {
    ...wireStretch(from, to),
    bucket_s: (to - from) / 240,
    reach: wireStretch(from, to),
    buckets: [],
    silences: [],
    runs: [],
    complete_to: wireTime(to),
    kept_from: wireTime(from),
    ...over,
  };
}
