/** The frames of the WebSocket. */
import { inSeconds } from './stamps';
import type {
  DeltaFrame,
  Frame,
  Judgement,
  Latest,
  Schemas,
  StateFrame,
  StatusFrame,
  TwinTagState,
} from './types';

/** Null for a state; undefined for what says neither how the twin is nor what it knows. */
export function statusOf(frame: Frame): StatusFrame | null | undefined {
  if (frame.type === 'status') return frame;
  return frame.type === 'state' || frame.type === 'delta' ? null : undefined;
}

/**
 * Throws if it is no frame; null: its type is from a later server. The server's tests compare its frames
 * with the schemas that the types here are from.
 */
export function parseFrame(data: unknown): Frame | null {
  const frame = inSeconds(JSON.parse(String(data))) as Frame;
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
    default:
      return null;
  }
}

type WireTag = Schemas['TwinTagState'];

/**
 * Restores the defaults that the server leaves out; `filledHealth` does so for verdicts. Derived values
 * are readings from here on: the catalogue knows which sensors are derived.
 */
export function filledTag({ derived = {}, derived_at: derivedAt, ...tag }: WireTag): TwinTagState {
  const { last_observed: last } = tag;
  let observedAt: WireTag['readings'][number]['observed_at'] = last;
  const readings = tag.readings.map((reading) => {
    if (reading.observed_at !== undefined) observedAt = reading.observed_at;
    return { ...reading, observed_at: observedAt ?? null };
  });
  if (derivedAt !== undefined) observedAt = derivedAt;
  for (const [name, value] of Object.entries(derived))
    readings.push({ name, value, observed_at: observedAt ?? null });
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
