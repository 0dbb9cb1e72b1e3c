/** What the routes answer, as far as the page reads it; nothing behind these checks again. */
import {
  also,
  count,
  list,
  number,
  numberOrNull,
  object,
  optional,
  orNull,
  record,
  type Check,
} from './check';
import { MAX_SENSORS, POSE, TEXT, TIME } from './shapes';

/** More scans than any twin keeps of one tag in memory. */
const MAX_SCANS = 20_000;
const MAX_AREAS = 200;
const MAX_AREA_TAGS = 10_000;

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
  source: orNull(TEXT),
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

/** Low and high, or null where nothing is out of it. */
const SPAN: Check = orNull(
  also(list(number, 2), (value) =>
    (value as readonly number[]).length === 2 ? null : ': is no pair of low and high',
  ),
);
const BOUNDS = { ideal: SPAN, critical: optional(SPAN) };
const RANGES = { ...BOUNDS, night: optional(object(BOUNDS)) };
const SENSOR = object({
  ...RANGES,
  label: TEXT,
  labels: optional(record(TEXT, MAX_SENSORS)),
  unit: TEXT,
  hue: number,
  lightness: number,
  derived: optional(list(TEXT, MAX_SENSORS)),
  species: optional(record(object(RANGES), MAX_SENSORS)),
});

export const SENSORS = object({
  ramp: object({ saturation: number, max_alpha: number }),
  fallback: SENSOR,
  sensors: record(SENSOR, MAX_SENSORS),
  areas: optional(record(list(TEXT, MAX_AREA_TAGS), MAX_AREAS)),
});
