/** What comes over the WebSocket, checked to the last field: nothing behind it checks again. */
import {
  also,
  boolean,
  count,
  list,
  number,
  numberOrNull,
  object,
  oneOf,
  record,
  type Check,
  orNull,
} from './check';
import { filledHealth, filledTag } from './filled';
import { ALARM, HEADER, HOUSE_HEALTH, MAX_SENSORS, TAG, TAG_HEALTH, TEXT, TIME } from './shapes';
import type { Alarm, Frame, TwinTagState } from './types';

/** Most characters of a frame: the largest house that a twin keeps is a bit smaller. */
export const MAX_FRAME_CHARS = 128_000_000;
/** More than a twin keeps; beyond it a page would stand still. */
export const MAX_TAGS = 50_000;

/** More than a house can have in a day without something else being wrong. */
export const MAX_ALARMS = 20_000;

/** Why messages may have been dropped; there are a dozen. */
const MAX_REASONS = 100;

/** No tag twice, and no more kinds of sensors than a table can have columns. */
const apart: Check = (value) => {
  const tags = value as readonly TwinTagState[];
  const ids = new Set<string>();
  const sensors = new Set<string>();
  for (const [index, { tag_id: id, readings }] of tags.entries()) {
    if (ids.has(id)) return `[${index}].tag_id: ${JSON.stringify(id).slice(0, 40)} a second time`;
    ids.add(id);
    for (const { name } of readings) sensors.add(name);
    if (sensors.size > MAX_SENSORS) {
      return `[${index}].readings: more than ${MAX_SENSORS} kinds of sensors`;
    }
  }
  return null;
};
/** All tags of a state. */
export const TAGS = also(list(TAG, MAX_TAGS), apart);

/** No alarm twice. */
const ALARMS = also(list(ALARM, MAX_ALARMS), (value) => {
  const ids = new Set<string>();
  for (const [index, { id }] of (value as readonly Alarm[]).entries()) {
    if (ids.has(id)) return `[${index}].id: ${JSON.stringify(id).slice(0, 40)} a second time`;
    ids.add(id);
  }
  return null;
});

/** What is said of the house and of each tag. */
export const HEALTH = object({ house: HOUSE_HEALTH, tags: record(TAG_HEALTH, MAX_TAGS) });

const FRAMES: Readonly<Record<Frame['type'], Check>> = {
  status: object({
    twin: oneOf('live', 'offline'),
    // Not one of those of today: a later server may know more reasons.
    reason: TEXT,
    message: TEXT,
    state_age_seconds: numberOrNull,
    has_map: boolean,
    // A word of a later server that is not known here is not told.
    origin: TEXT,
    input_problems: list(TEXT, MAX_REASONS),
    drops: list(object({ reason: TEXT, message: TEXT, count }), MAX_REASONS),
    journal: object({
      // Nor this: a state that is not known here is not told, and no reason to stop.
      state: TEXT,
      detail: TEXT,
      set_aside: TEXT,
      simulated: orNull(object({ start: TIME, end: TIME })),
    }),
    outward: list(object({ channel: TEXT, is_failing: boolean, detail: TEXT }), MAX_REASONS),
  }),
  state: object({
    seq: number,
    revision: TEXT,
    state: object({ header: HEADER, tags: TAGS }),
    health: HEALTH,
  }),
  delta: object({
    seq: number,
    base: number,
    revision: TEXT,
    header: HEADER,
    changed: TAGS,
    removed: list(TEXT, MAX_TAGS),
    health: HEALTH,
  }),
  alarms: object({
    alarms: ALARMS,
    // Not one of those of today: a later server may have them from elsewhere.
    source: TEXT,
    since: orNull(TIME),
  }),
};

/** A message of which nothing but the type was looked at. */
export interface Unread {
  readonly type: string;
}

/** "passed over": a robot's, which is read by who shows it, or a type of a later server. */
export type Parsed =
  | { readonly kind: 'frame'; readonly frame: Frame }
  | { readonly kind: 'passed over'; readonly message: Unread }
  | { readonly kind: 'bad'; readonly why: string; readonly isDelta: boolean };

const bad = (why: string, isDelta = false): Parsed => ({ kind: 'bad', why, isDelta });

/** Reads one WebSocket message. */
export function parseFrame(data: unknown): Parsed {
  if (typeof data !== 'string') return bad('a message that is no text');
  if (data.length > MAX_FRAME_CHARS) {
    return bad(`a frame of ${data.length} characters, the limit is ${MAX_FRAME_CHARS}`);
  }
  let message: unknown;
  try {
    message = JSON.parse(data);
  } catch {
    return bad('a message that is no JSON');
  }
  const fault = object({ type: TEXT })(message);
  if (fault !== null) return bad(`frame${fault}`);
  const { type } = message as Unread;
  if (!isKnown(type)) return { kind: 'passed over', message: message as Unread };
  const why = FRAMES[type](message);
  if (why !== null) return bad(type + why, type === 'delta');
  return { kind: 'frame', frame: filled(message as Frame) };
}

function filled(frame: Frame): Frame {
  switch (frame.type) {
    case 'state': {
      const state = { ...frame.state, tags: frame.state.tags.map(filledTag) };
      return { ...frame, state, health: filledHealth(frame.health) };
    }
    case 'delta': {
      const changed = frame.changed.map(filledTag);
      return { ...frame, changed, health: filledHealth(frame.health) };
    }
    case 'status':
    case 'alarms':
      return frame;
  }
}

const isKnown = (type: string): type is Frame['type'] => Object.hasOwn(FRAMES, type);
