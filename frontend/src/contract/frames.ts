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
  type Check,
} from './check';
import { HEADER, MAX_SENSORS, TAG, TEXT } from './shapes';
import type { Frame, TwinTagState } from './types';

/** Most characters of a frame: the largest house that a twin keeps is a bit smaller. */
export const MAX_FRAME_CHARS = 128_000_000;
/** More than a twin keeps; beyond it a page would stand still. */
export const MAX_TAGS = 50_000;

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
const TAGS = also(list(TAG, MAX_TAGS), apart);

const FRAMES: Readonly<Record<Frame['type'], Check>> = {
  status: object({
    twin: oneOf('live', 'offline'),
    // Not one of those of today: a later server may know more reasons.
    reason: TEXT,
    message: TEXT,
    state_age_seconds: numberOrNull,
    has_map: boolean,
    drops: list(object({ reason: TEXT, message: TEXT, count }), MAX_REASONS),
  }),
  state: object({ seq: number, revision: TEXT, state: object({ header: HEADER, tags: TAGS }) }),
  delta: object({
    seq: number,
    base: number,
    revision: TEXT,
    header: HEADER,
    changed: TAGS,
    removed: list(TEXT, MAX_TAGS),
  }),
};

/** "passed over": a type that this page does not know, of a later server. */
export type Parsed =
  | { readonly kind: 'frame'; readonly frame: Frame }
  | { readonly kind: 'passed over' }
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
  const { type } = message as { readonly type: string };
  if (!isKnown(type)) return { kind: 'passed over' };
  const why = FRAMES[type](message);
  if (why !== null) return bad(type + why, type === 'delta');
  return { kind: 'frame', frame: message as Frame };
}

const isKnown = (type: string): type is Frame['type'] => Object.hasOwn(FRAMES, type);
