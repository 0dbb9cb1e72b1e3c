/** The messages that frames and answers are made of, field by field. */
import {
  boolean,
  count,
  integer,
  list,
  numberOrNull,
  object,
  oneOf,
  optional,
  orNull,
  text,
} from './check';

/** Kinds of sensors of one tag, and in one frame: each is a column of the table. */
export const MAX_SENSORS = 256;
const MAX_BLOOMS_PER_TAG = 10_000;
const MAX_FOOTPRINT_POINTS = 1_000;

export const TEXT = text(65_536);
export const TIME = object({ sec: integer, nanosec: count });
export const HEADER = object({ stamp: TIME, frame_id: TEXT });
const POINT = object({ x: numberOrNull, y: numberOrNull, z: numberOrNull });
const QUATERNION = object({ x: numberOrNull, y: numberOrNull, z: numberOrNull, w: numberOrNull });
export const POSE = object({ position: POINT, orientation: QUATERNION });
export const TAG = object({
  tag_id: TEXT,
  pose: POSE,
  readings: list(
    object({
      name: TEXT,
      value: numberOrNull,
      observed_at: optional(orNull(TIME)),
    }),
    MAX_SENSORS,
  ),
  last_observed: TIME,
  stale_seconds: numberOrNull,
  species: TEXT,
  species_confidence: numberOrNull,
  anomaly: boolean,
  flower_count: count,
  bug_count: count,
  flowers: list(
    object({
      position: POINT,
      height_m: numberOrNull,
      species: TEXT,
      confidence: numberOrNull,
      anomaly: boolean,
    }),
    MAX_BLOOMS_PER_TAG,
  ),
  box_footprint: object({ points: list(POINT, MAX_FOOTPRINT_POINTS) }),
  looked_at: optional(orNull(TIME)),
  last_try: optional(orNull(TIME)),
  last_try_status: optional(numberOrNull),
  last_try_detail: optional(TEXT),
});

const MAX_REASONS_PER_TAG = 1_000;
const VERDICT = oneOf('critical', 'stressed', 'unknown', 'healthy');
const REASON = object({
  // Not one of those of today: a later server may know more reasons.
  kind: TEXT,
  verdict: VERDICT,
  sensor: TEXT,
  value: numberOrNull,
  limit: numberOrNull,
  since: orNull(TIME),
});
const HEALTH = { verdict: VERDICT, reasons: optional(list(REASON, MAX_REASONS_PER_TAG)) };
export const TAG_HEALTH = object(HEALTH);
export const HOUSE_HEALTH = object({
  ...HEALTH,
  day: object({ is_day: boolean, source: TEXT }),
  patrol: object({ interval_s: numberOrNull, last_scan: orNull(TIME), overdue: count }),
});

export const ALARM = object({
  id: TEXT,
  reason: REASON,
  tag_id: TEXT,
  raised_at: TIME,
  cleared_at: orNull(TIME),
  worst: numberOrNull,
});
