/**
 * The newest state, put together from full frames and deltas. Pure.
 *
 * A delta names the frame that it builds on. Frames of one connection come in order, so a delta
 * that builds on another frame than the last means that the two sides have lost each other.
 */
import { secondsBetween } from '../contract/time';
import type { DeltaFrame, Latest, StateFrame, TwinTagState, WireTime } from '../contract/types';

/** The state after a frame; null where the frame does not build on what is there. */
export function latestAfter(latest: Latest | null, frame: StateFrame | DeltaFrame): Latest | null {
  if (frame.type === 'state') return frame;
  if (latest?.seq !== frame.base) return null;
  const changed = new Map(frame.changed.map((tag) => [tag.tag_id, tag]));
  const removed = new Set(frame.removed);
  const { stamp } = frame.header;
  const tags = latest.state.tags.flatMap((tag) => {
    const now = changed.get(tag.tag_id);
    changed.delete(tag.tag_id);
    if (now) return [now];
    return removed.has(tag.tag_id) ? [] : [aged(tag, stamp)];
  });
  return {
    seq: frame.seq,
    revision: frame.revision,
    state: { header: frame.header, tags: [...tags, ...changed.values()] },
    health: { house: frame.health.house, tags: healthsAfter(latest, frame) },
  };
}

/** The very same where nobody's health is another. */
function healthsAfter({ health }: Latest, frame: DeltaFrame): Latest['health']['tags'] {
  const isSame = frame.removed.length === 0 && Object.keys(frame.health.tags).length === 0;
  if (isSame) return health.tags;
  const tags = new Map(Object.entries(health.tags));
  for (const tagId of frame.removed) tags.delete(tagId);
  for (const [tagId, now] of Object.entries(frame.health.tags)) tags.set(tagId, now);
  return Object.fromEntries(tags);
}

/** An unchanged tag at a later moment; everything but its age is the very same. */
function aged(tag: TwinTagState, stamp: WireTime): TwinTagState {
  if (tag.stale_seconds === null) return tag;
  const readings = tag.readings.map((reading) =>
    reading.observed_at === null || reading.stale_seconds === null
      ? reading
      : { ...reading, stale_seconds: secondsBetween(reading.observed_at, stamp) },
  );
  return { ...tag, readings, stale_seconds: secondsBetween(tag.last_observed, stamp) };
}
