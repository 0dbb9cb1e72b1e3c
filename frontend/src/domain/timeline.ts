/** What happened when, and how far back anything is remembered. Times are ROS seconds. */
import type { Timeline as WireTimeline, WireTime } from '../contract/types';
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

/** The parts of a period that an answer does not vouch for: nobody may take them for silence. */

/** A stretch of which something may have been received that the answer does not have. */
export interface Missing extends Span {
  readonly why: 'not_kept' | 'not_recorded';
}

interface Told {
  readonly from: WireTime;
  readonly to: WireTime;
  readonly complete_to: WireTime | null;
  readonly kept_from: WireTime | null;
}

/** The twin says once a second how far its journal is. */
const SLACK_S = 5;

/** `nowS` is the twin's time at which it was told: of what comes later nothing is missing. */
export function missingOf(told: Told, nowS: number): readonly Missing[] {
  const [from, to] = [secondsOf(told.from), Math.min(secondsOf(told.to), nowS)];
  const missing: Missing[] = [];
  if (told.kept_from) missing.push({ from, to: secondsOf(told.kept_from), why: 'not_kept' });
  const complete = told.complete_to && secondsOf(told.complete_to);
  if (complete !== null && to - complete > SLACK_S) {
    missing.push({ from: Math.max(from, complete), to, why: 'not_recorded' });
  }
  return missing.filter((stretch) => stretch.to > stretch.from);
}
