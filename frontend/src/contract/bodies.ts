/** What the routes answer, as far as the page reads it; nothing behind these checks again. */
import { boolean, count, list, number, numberOrNull, object, orNull } from './check';
import { MAX_SENSORS, POSE, TEXT, TIME } from './shapes';

/** More scans than any twin keeps of one tag in memory. */
const MAX_SCANS = 20_000;

export const SESSION = object({ can_sign_out: boolean });

export const MAP = object({
  info: object({ resolution: number, width: count, height: count, origin: POSE }),
});

export const QUALITY = object({
  sensor_type: TEXT,
  rmse: numberOrNull,
  worst: orNull(object({ tag_id: TEXT, error: number })),
});

export const HISTORY = object({
  tag_id: TEXT,
  is_known: boolean,
  tries: list(
    object({ stamp: TIME, status: number, status_detail: TEXT, kind: numberOrNull }),
    MAX_SCANS,
  ),
  sensors: list(
    object({
      name: TEXT,
      values: list(object({ stamp: TIME, value: numberOrNull }), MAX_SCANS),
    }),
    MAX_SENSORS,
  ),
});
