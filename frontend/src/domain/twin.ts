import type { Latest, TagHealth, TwinTagState, WirePoint } from '../contract/types';
import { mapPoint, type MapPoint } from '../geometry/coordinates';
import type { Shared } from './memo';
import type { When } from './time';

export interface FailedAttempt {
  readonly at: When;
  /** As in lupin_msgs/Observation; never 0, which is a success. */
  readonly status: number;
  readonly detail: string;
}

/** One tag as the page uses it. Strings are as received: show them through `domain/text`. */
export type Tag = Shared<ReturnType<typeof tagOf>>;

export interface Snapshot {
  /** Sorted by id; the same list as before if only time has passed. */
  readonly tags: readonly Tag[];
  /** Changes exactly when a field or the map may have changed. */
  readonly revision: string;
  /** Time of the state, ROS seconds. */
  readonly at: number;
  /** When this state was new, ms on the browser's monotonic clock. */
  readonly takenAt: number;
  /** Whether it is complete; else the journal lacks data of that time. */
  readonly isWhole: boolean;
}

/** Null for a point with a coordinate that is not finite (null on the wire). */
function pointOf(point: WirePoint): MapPoint | null {
  return point.x === null || point.y === null ? null : mapPoint(point.x, point.y);
}

/** Below it the bridge judges by the ranges for all species: the twin's `sure_species`. */
const SURE = 0.5;

/** The species whose ranges hold: the last one that the camera was sure of; empty: none. */
const sureSpeciesOf = (wire: TwinTagState, judged?: TagHealth): string =>
  judged?.species || ((wire.species_confidence ?? 0) >= SURE ? wire.species : '');

export function tagOf(wire: TwinTagState, judged?: TagHealth) {
  const { position, orientation } = wire.pose;
  const isObserved = wire.stale_seconds !== null;
  const readAt = new Map(
    wire.readings.map(({ name, observed_at: at }): [string, When] => [
      name,
      // Without the tag's age, the ages of its readings are unknown.
      isObserved && at !== null ? at : 'unknown',
    ]),
  );
  const { looked_at: inspected, last_try: attempted, last_try_status: status } = wire;
  return {
    id: wire.tag_id,
    /** Metres; null: no pin, as the tag has no pose or is far off. */
    // w is exactly 0 where the twin has no pose; every rotation about z by less than half a
    // turn has another w, and ROS itself defaults it to 1.
    at: orientation.w === 0 || orientation.w === null ? null : pointOf(position),
    /** Its place if too far from the others for the map; else null. */
    farOff: null as MapPoint | null,
    /** Latest reading by sensor, in its unit; null: the sensor gave not-a-number. */
    readings: new Map(wire.readings.map(({ name, value }) => [name, value])),
    /** When each reading was taken: a flower inspection makes none younger. */
    readAt,
    /** When the newest reading was taken. */
    scannedAt: newest(readAt.values()),
    /** When the flowers were last inspected; "never" also if the twin does not report it. */
    inspectedAt: (inspected ?? 'never') as When,
    /** The last scan or inspection, if it failed. */
    failedAttempt:
      attempted === null || status === null || status === 0
        ? null
        : ({ at: attempted, status, detail: wire.last_try_detail } as FailedAttempt),
    /** Whether it was ever observed, with a known age. */
    isObserved,
    species: wire.species,
    speciesConfidence: wire.species_confidence,
    sureSpecies: sureSpeciesOf(wire, judged),
    anomaly: wire.anomaly,
    flowerCount: wire.flower_count,
    bugCount: wire.bug_count,
    blooms: wire.flowers.flatMap((flower) => {
      const at = pointOf(flower.position);
      return at ? [{ at, species: flower.species }] : [];
    }),
    /** Outline of the planter box. */
    footprint: wire.box_footprint.points.flatMap((point) => pointOf(point) ?? []),
    wire,
  };
}

/** The latest of some times; "unknown" if all are, "never" without any. */
function newest(times: Iterable<When>): When {
  let latest: When = 'never';
  for (const time of times) {
    if (typeof time !== 'number') latest = latest === 'never' ? time : latest;
    else latest = typeof latest === 'number' ? Math.max(latest, time) : time;
  }
  return latest;
}

/** The previous tag if only its age has grown: the page renders only what changed. */
function sharedTag(before: Tag | undefined, wire: TwinTagState, judged?: TagHealth): Tag {
  const isShared =
    before?.isObserved === (wire.stale_seconds !== null) &&
    before.sureSpecies === sureSpeciesOf(wire, judged) &&
    equal(wire, before.wire);
  return isShared ? before : tagOf(wire, judged);
}

/** Deep equality of plain JSON values, except ages. */
export function equal(a: unknown, b: unknown): boolean {
  if (a === b) return true;
  if (typeof a !== 'object' || typeof b !== 'object' || a === null || b === null) return false;
  const keys = Object.keys(a);
  return (
    keys.length === Object.keys(b).length &&
    keys.every(
      (key) =>
        key === 'stale_seconds' ||
        equal((a as Record<string, unknown>)[key], (b as Record<string, unknown>)[key]),
    )
  );
}

/**
 * The snapshot of a state. `arrivedAt` is when its frame arrived, minus the state's age if it was old,
 * ms on the monotonic clock.
 *
 * A frame that repeats the previous state (a heartbeat of a bridge without a twin) is not new: it keeps
 * the older `takenAt`, or every heartbeat would make the readings look fresh.
 */
export function snapshotOf(latest: Latest, arrivedAt: number, before: Snapshot | null): Snapshot {
  const at = latest.state.header.stamp;
  const isRepeated = before?.at === at;
  const takenAt = isRepeated ? Math.min(before.takenAt, arrivedAt) : arrivedAt;
  const known = new Map(before?.tags.map((tag) => [tag.id, tag]));
  const judged = latest.health.tags;
  const read = latest.state.tags.map((wire) =>
    sharedTag(known.get(wire.tag_id), wire, judged[wire.tag_id]),
  );
  const tags = inOrder(read, known, before?.tags ?? []);
  return {
    tags,
    revision: latest.revision,
    at,
    takenAt,
    isWhole: latest.isWhole ?? true,
  };
}

export const reachOfTags = (tags: readonly Tag[]): Reach =>
  reachOf(tags.flatMap((tag) => tag.at ?? tag.farOff ?? []));

function within(reach: Reach, tag: Tag): Tag {
  const place = tag.at ?? tag.farOff;
  const isFar = place !== null && !holds(reach, place);
  return isFar === (tag.farOff !== null)
    ? tag
    : { ...tag, at: isFar ? null : place, farOff: isFar ? place : null };
}

/**
 * Tags sorted by id, without the places that are far off. Returns the previous list if each tag is the
 * same object, so that nothing is redrawn.
 */
function inOrder(
  read: readonly Tag[],
  known: ReadonlyMap<string, Tag>,
  before: readonly Tag[],
): readonly Tag[] {
  const areIdsAsBefore = read.length === before.length && read.every((tag) => known.has(tag.id));
  if (areIdsAsBefore && read.every((tag) => known.get(tag.id) === tag)) return before;
  const reach = reachOfTags(read);
  const tags = read.map((tag) => within(reach, tag));
  if (areIdsAsBefore) {
    const now = new Map(tags.map((tag) => [tag.id, tag]));
    if (now.size === before.length) return before.map((tag) => now.get(tag.id) ?? tag);
  }
  return [...tags].sort((a, b) => compareIds(a.id, b.id));
}

const collator = new Intl.Collator('en', { numeric: true });

/** Order of tag ids: numbers by value ("9" before "10"), then letters. */
export function compareIds(a: string, b: string): number {
  return collator.compare(a, b) || (a < b ? -1 : a > b ? 1 : 0);
}

/**
 * Which tags are too far from the others for the map: the same rule as in `lupin_twin/field/grid.py`, which
 * explains it. `tests/twin/core/far_off.json` tests both.
 */

/** A circle around the centre of the tags, metres; a tag outside is far off. */
interface Reach {
  readonly x: number;
  readonly y: number;
  readonly radius: number;
}

const FARTHEST_M = 1e6;
const ALWAYS_NEAR_M = 200;
const SPREADS = 10;
const ONE_IN = 3;

const EVERYWHERE: Reach = { x: 0, y: 0, radius: Infinity };

export const isPossible = ({ x, y }: Readonly<{ x: number; y: number }>): boolean =>
  Math.abs(x) <= FARTHEST_M && Math.abs(y) <= FARTHEST_M;

export const holds = (reach: Reach, point: MapPoint): boolean =>
  isPossible(point) && Math.hypot(point.x - reach.x, point.y - reach.y) <= reach.radius;

export function reachOf(places: readonly MapPoint[]): Reach {
  const possible = places.filter(isPossible);
  const x = medianLow(possible.map((place) => place.x));
  const y = medianLow(possible.map((place) => place.y));
  const distances = possible.map((place) => Math.hypot(place.x - x, place.y - y));
  const radius = Math.max(ALWAYS_NEAR_M, SPREADS * medianLow(distances));
  const far = distances.filter((distance) => distance > radius).length;
  if (possible.length === 0 || far > Math.floor(possible.length / ONE_IN)) return EVERYWHERE;
  return { x, y, radius };
}

/** The median; of an even count the lower of the two, 0 of none. */
function medianLow(values: readonly number[]): number {
  const sorted = Float64Array.from(values).sort();
  return sorted[(sorted.length - 1) >> 1] ?? 0;
}
