/** What happened when, and how far back anything is remembered. Times are ROS seconds. */
import type { Timeline as WireTimeline } from '../contract/types';
import { missingOf, type Missing } from './missing';
import type { Span } from './period';
import { secondsOf } from './rostime';

/** What happened in one bucket. */
export interface Happened {
  /** When the bucket begins. */
  readonly start: number;
  readonly scans: number;
  readonly failures: number;
  readonly looks: number;
  readonly pestsSeen: number;
  readonly pestsCleared: number;
}

export interface ClockRun extends Span {
  readonly isSimulated: boolean;
}

export interface Timeline extends Span {
  /** How long a bucket is, seconds. */
  readonly bucketS: number;
  /** What memory holds at all; null: nothing yet. */
  readonly reach: Span | null;
  /** By their time; one in which nothing happened is left out. */
  readonly buckets: readonly Happened[];
  readonly silences: readonly Span[];
  readonly runs: readonly ClockRun[];
  readonly missing: readonly Missing[];
}

type WireSpan = WireTimeline['silences'][number];

const spanOfWire = ({ from, to }: WireSpan): Span => ({ from: secondsOf(from), to: secondsOf(to) });

/** `nowS`: the twin's time, ROS seconds, as it was told. */
export function timelineOf(wire: WireTimeline, nowS: number): Timeline {
  return {
    ...spanOfWire(wire),
    bucketS: wire.bucket_s,
    reach: wire.reach && spanOfWire(wire.reach),
    buckets: wire.buckets.map((bucket) => ({
      start: secondsOf(bucket.start),
      scans: bucket.scans,
      failures: bucket.failures,
      looks: bucket.looks,
      pestsSeen: bucket.pests_seen,
      pestsCleared: bucket.pests_cleared,
    })),
    silences: wire.silences.map(spanOfWire),
    runs: wire.runs.map((run) => ({ ...spanOfWire(run), isSimulated: run.is_simulated })),
    missing: missingOf(wire, nowS),
  };
}
