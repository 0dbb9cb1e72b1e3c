/** The frames of the WebSocket, checked completely: no later code checks again. */
import { checkOf, isObject } from './check';
import type {
  DeltaFrame,
  Frame,
  Judgement,
  Latest,
  Schemas,
  StateFrame,
  TwinTagState,
} from './types';

/** Longest frame, characters: slightly more than the largest greenhouse needs. */
export const MAX_FRAME_CHARS = 128_000_000;

const FRAMES: Readonly<Record<Frame['type'], string>> = {
  status: 'StatusFrame',
  state: 'StateFrame',
  delta: 'DeltaFrame',
  alarms: 'AlarmsFrame',
  robot: 'RobotFrame',
};

/** "passed over": a type from a later server. */
type Parsed =
  | { readonly kind: 'frame'; readonly frame: Frame }
  | { readonly kind: 'passed over' }
  | { readonly kind: 'bad'; readonly why: string; readonly isDelta: boolean };

const bad = (why: string, isDelta = false): Parsed => ({ kind: 'bad', why, isDelta });

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
  if (!isObject(message) || typeof message['type'] !== 'string') return bad('a frame without type');
  const { type } = message;
  if (!isKnown(type)) return { kind: 'passed over' };
  const why = checkOf(FRAMES[type])(message);
  if (why !== null) return bad(type + why, type === 'delta');
  return { kind: 'frame', frame: filled(message as unknown as Frame) };
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
    case 'robot':
      return frame;
  }
}

const isKnown = (type: string): type is Frame['type'] => Object.hasOwn(FRAMES, type);

type WireTag = Schemas['TwinTagState'];

/** Restores the defaults that the server leaves out; `filledHealth` does so for verdicts. */
export function filledTag(tag: WireTag): TwinTagState {
  const { last_observed: last } = tag;
  let observedAt: WireTag['readings'][number]['observed_at'] = last;
  const readings = tag.readings.map((reading) => {
    if (reading.observed_at !== undefined) observedAt = reading.observed_at;
    return { ...reading, observed_at: observedAt ?? null };
  });
  return {
    looked_at: null,
    last_try: last,
    last_try_status: 0,
    last_try_detail: '',
    ...tag,
    readings,
  };
}

export const filledHealth = ({ house, tags }: Schemas['Judgement']): Judgement => ({
  house: { reasons: [], ...house },
  tags: Object.fromEntries(Object.entries(tags).map(([id, tag]) => [id, { reasons: [], ...tag }])),
});

/**
 * The state after a frame; null if a delta does not fit. A delta names the frame that it builds on. Frames
 * of one connection arrive in order, so any other than the last means that the two sides are out of step.
 */
export function latestAfter(latest: Latest | null, frame: StateFrame | DeltaFrame): Latest | null {
  if (frame.type === 'state') return frame;
  if (latest?.seq !== frame.base) return null;
  const changed = new Map(frame.changed.map((tag) => [tag.tag_id, tag]));
  const removed = new Set(frame.removed);
  const tags = latest.state.tags.flatMap((tag) => {
    const now = changed.get(tag.tag_id) ?? tag;
    changed.delete(tag.tag_id);
    return removed.has(tag.tag_id) ? [] : [now];
  });
  return {
    seq: frame.seq,
    revision: frame.revision,
    state: { header: frame.header, tags: [...tags, ...changed.values()] },
    health: { house: frame.health.house, tags: healthsAfter(latest, frame) },
  };
}

/** The same object if no tag's health has changed. */
function healthsAfter({ health }: Latest, frame: DeltaFrame): Latest['health']['tags'] {
  const isSame = frame.removed.length === 0 && Object.keys(frame.health.tags).length === 0;
  if (isSame) return health.tags;
  const tags = new Map(Object.entries(health.tags));
  for (const tagId of frame.removed) tags.delete(tagId);
  for (const [tagId, now] of Object.entries(frame.health.tags)) tags.set(tagId, now);
  return Object.fromEntries(tags);
}
