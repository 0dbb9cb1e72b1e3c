import type { StateFrame, TwinTagState, WirePoint, WireTime } from '../contract/types';
import { mapPoint, type MapPoint } from '../geometry/coordinates';

export interface Bloom {
  readonly at: MapPoint;
  readonly species: string;
  readonly anomaly: boolean;
}

/** One tag as the page uses it. Strings are as they came: show them through `domain/text`. */
export interface Tag {
  readonly id: string;
  /** Metres; null: the tag has no pose and gets no pin. */
  readonly at: MapPoint | null;
  /** Latest reading by sensor, in its unit; null: the sensor gave not-a-number. */
  readonly readings: ReadonlyMap<string, number | null>;
  /** Seconds since the last observation when the snapshot was taken; null: never observed. */
  readonly staleSeconds: number | null;
  /** ROS time of the last observation, as a key to compare; "0.0" when there was none. */
  readonly observation: string;
  readonly species: string;
  readonly speciesConfidence: number | null;
  readonly anomaly: boolean;
  readonly flowerCount: number;
  readonly bugCount: number;
  readonly blooms: readonly Bloom[];
  /** Outline of the planter box. */
  readonly footprint: readonly MapPoint[];
}

/** The greenhouse at one moment. */
export interface Snapshot {
  readonly tags: readonly Tag[];
  /** Changes exactly when a field or the map could have changed. */
  readonly revision: string;
  /** ROS time of the state, as a key to compare. */
  readonly stamp: string;
  /** When this state was new, ms on the browser's monotonic clock. */
  readonly takenAt: number;
  /** Tags observed since the snapshot before. */
  readonly fresh: readonly string[];
}

const timeKey = (time: WireTime): string => `${time.sec}.${time.nanosec}`;

/** A point with a coordinate that is not finite (null on the wire) is no point. */
function pointOf(point: WirePoint): MapPoint | null {
  return point.x === null || point.y === null ? null : mapPoint(point.x, point.y);
}

function presentPoints(points: readonly WirePoint[]): MapPoint[] {
  return points.map(pointOf).filter((point) => point !== null);
}

export function tagOf(wire: TwinTagState): Tag {
  const { position, orientation } = wire.pose;
  return {
    id: wire.tag_id,
    // w is exactly 0 where the twin has no pose; every rotation about z by less than half a
    // turn has another w, and ROS itself defaults it to 1.
    at: orientation.w === 0 || orientation.w === null ? null : pointOf(position),
    readings: new Map(wire.readings.map(({ name, value }) => [name, value])),
    staleSeconds: wire.stale_seconds,
    observation: timeKey(wire.last_observed),
    species: wire.species,
    speciesConfidence: wire.species_confidence,
    anomaly: wire.anomaly,
    flowerCount: wire.flower_count,
    bugCount: wire.bug_count,
    blooms: wire.flowers.flatMap((flower) => {
      const at = pointOf(flower.position);
      return at ? [{ at, species: flower.species, anomaly: flower.anomaly }] : [];
    }),
    footprint: presentPoints(wire.box_footprint.points),
  };
}

/**
 * The snapshot that a state frame makes. `arrivedAt` is when the frame came, less the state's
 * age if it was old then, ms on the monotonic clock.
 *
 * A frame that repeats the state before (a heartbeat of a bridge whose twin is gone) is not new:
 * it keeps the older `takenAt`, or every heartbeat would make the readings look fresh again.
 */
export function snapshotOf(
  frame: StateFrame,
  arrivedAt: number,
  before: Snapshot | null,
): Snapshot {
  const stamp = timeKey(frame.state.header.stamp);
  const repeated = before?.stamp === stamp;
  const tags = frame.state.tags.map(tagOf).sort((a, b) => compareIds(a.id, b.id));
  return {
    tags,
    revision: frame.revision,
    stamp,
    takenAt: repeated ? Math.min(before.takenAt, arrivedAt) : arrivedAt,
    fresh: before ? freshTags(before.tags, tags) : [],
  };
}

function freshTags(before: readonly Tag[], now: readonly Tag[]): string[] {
  const known = new Map(before.map((tag) => [tag.id, tag.observation]));
  return now
    .filter((tag) => tag.staleSeconds !== null && known.get(tag.id) !== tag.observation)
    .map((tag) => tag.id);
}

const collator = new Intl.Collator('en', { numeric: true });

/** Order of tag ids: numbers by value ("9" before "10"), then letters. */
export function compareIds(a: string, b: string): number {
  return collator.compare(a, b) || (a < b ? -1 : a > b ? 1 : 0);
}
