import type { Latest, TwinTagState, WirePoint, WireTime } from '../contract/types';
import { mapPoint, type MapPoint } from '../geometry/coordinates';
import type { Shared } from './memo';
import type { When } from './time';

export interface FailedAttempt {
  readonly at: When;
  /** As in lupin_msgs/Observation; never 0, which is a success. */
  readonly status: number;
  readonly detail: string;
}

/** One tag as the page uses it. Strings are as they came: show them through `domain/text`. */
export type Tag = Shared<ReturnType<typeof tagOf>>;

export interface Snapshot {
  /** By their ids; the same list as before if nothing but the time went on. */
  readonly tags: readonly Tag[];
  /** Changes exactly when a field or the map could have changed. */
  readonly revision: string;
  /** ROS time of the state. */
  readonly at: WireTime;
  /** When this state was new, ms on the browser's monotonic clock. */
  readonly takenAt: number;
  /** Tags observed since the snapshot before. */
  readonly fresh: readonly string[];
  /** Whether what is not in it never was; else the journal does not have all of then. */
  readonly isWhole: boolean;
}

/** A point with a coordinate that is not finite (null on the wire) is no point. */
function pointOf(point: WirePoint): MapPoint | null {
  return point.x === null || point.y === null ? null : mapPoint(point.x, point.y);
}

type TakenState = Pick<Snapshot, 'at' | 'takenAt'>;

/**
 * A ROS time on the monotonic clock: a difference to the wall clock would be wrong in simulation, and
 * on a tablet that is off. A state without a time of its own (0) dates nothing.
 */
export function whenOf(time: WireTime, { at, takenAt }: TakenState): When {
  if (at.sec === 0 && at.nanosec === 0) return 'unknown';
  const age = at.sec - time.sec + (at.nanosec - time.nanosec) / 1e9;
  return takenAt - Math.max(0, age) * 1000;
}

/** Below it the bridge judges by what holds for all: `sure_species` of the twin. */
const SURE = 0.5;

export function tagOf(wire: TwinTagState, state: TakenState) {
  const { position, orientation } = wire.pose;
  const readAt = new Map(
    wire.readings.map((reading): [string, When] => [reading.name, readAtOf(wire, reading, state)]),
  );
  const { looked_at: inspected, last_try: attempted, last_try_status: status } = wire;
  return {
    id: wire.tag_id,
    /** Metres; null: the tag has no pose, or one that is far off, and gets no pin. */
    // w is exactly 0 where the twin has no pose; every rotation about z by less than half a
    // turn has another w, and ROS itself defaults it to 1.
    at: orientation.w === 0 || orientation.w === null ? null : pointOf(position),
    /** Where it was pinned, too far from the others for any map; null: it was not. */
    farOff: null as MapPoint | null,
    /** Latest reading by sensor, in its unit; null: the sensor gave not-a-number. */
    readings: new Map(wire.readings.map(({ name, value }) => [name, value])),
    /** When each reading was made: a look at the flowers makes none younger. */
    readAt,
    /** When the newest reading was made. */
    scannedAt: newest(readAt.values()),
    /** When the flowers were last looked at; "never" also where the twin does not tell. */
    inspectedAt: inspected === null ? 'never' : whenOf(inspected, state),
    /** The last scan or look, if it brought nothing. */
    failedAttempt:
      attempted === null || status === null || status === 0
        ? null
        : ({ at: whenOf(attempted, state), status, detail: wire.last_try_detail } as FailedAttempt),
    /** Whether it was ever observed in any way, and how long ago is known. */
    isObserved: wire.stale_seconds !== null,
    species: wire.species,
    speciesConfidence: wire.species_confidence,
    /** The species whose ranges hold; empty where the camera was not sure, as the bridge judges. */
    sureSpecies: (wire.species_confidence ?? 0) >= SURE ? wire.species : '',
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

/** A tag without an age has no reading of a known one. */
const readAtOf = (
  { stale_seconds: age }: TwinTagState,
  { observed_at: at }: TwinTagState['readings'][number],
  state: TakenState,
): When => (age === null || at == null ? 'unknown' : whenOf(at, state));

/** The latest of some times; "unknown" where there are only such, "never" without any. */
function newest(times: Iterable<When>): When {
  let latest: When = 'never';
  for (const time of times) {
    if (typeof time !== 'number') latest = latest === 'never' ? time : latest;
    else latest = typeof latest === 'number' ? Math.max(latest, time) : time;
  }
  return latest;
}

/** Ages of one observation that differ by less come from the network, not from a new look. */
const JITTER_MS = 1_500;

/**
 * The tag as it was, if nothing but its age went on: the page renders only what changed. Where
 * the twin's clock runs at another speed (simulation), its ages still win.
 */
function sharedTag(before: Tag | undefined, wire: TwinTagState, state: TakenState): Tag {
  const isSame = (name: string, now: When): boolean => {
    const known = before?.readAt.get(name);
    return typeof known === 'number' && typeof now === 'number'
      ? Math.abs(now - known) < JITTER_MS
      : known === now;
  };
  const isShared =
    before?.isObserved === (wire.stale_seconds !== null) &&
    equal(wire, before.wire) &&
    wire.readings.every((reading) => isSame(reading.name, readAtOf(wire, reading, state)));
  return isShared ? before : tagOf(wire, state);
}

/** Deep equality of plain JSON values, but for ages. */
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
 * The snapshot that a state makes. `arrivedAt` is when its frame came, less the state's
 * age if it was old then, ms on the monotonic clock.
 *
 * A frame that repeats the state before (a heartbeat of a bridge whose twin is gone) is not new:
 * it keeps the older `takenAt`, or every heartbeat would make the readings look fresh again.
 */
export function snapshotOf(latest: Latest, arrivedAt: number, before: Snapshot | null): Snapshot {
  const at = latest.state.header.stamp;
  const isRepeated = before !== null && equal(before.at, at);
  const takenAt = isRepeated ? Math.min(before.takenAt, arrivedAt) : arrivedAt;
  const state = { at, takenAt };
  const known = new Map(before?.tags.map((tag) => [tag.id, tag]));
  const read = latest.state.tags.map((wire) => sharedTag(known.get(wire.tag_id), wire, state));
  const tags = inOrder(read, known, before?.tags ?? []);
  return {
    tags,
    revision: latest.revision,
    ...state,
    fresh: before && tags !== before.tags ? freshTags(known, tags) : [],
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
 * By their ids, as the map shows them. The very list of before if each tag is the very same: then
 * nothing is redrawn.
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

function freshTags(before: ReadonlyMap<string, Tag>, now: readonly Tag[]): string[] {
  return now
    .filter(({ id, isObserved, wire }) => {
      const was = before.get(id)?.wire.last_observed;
      return isObserved && !equal(was, wire.last_observed);
    })
    .map((tag) => tag.id);
}

const collator = new Intl.Collator('en', { numeric: true });

/** Order of tag ids: numbers by value ("9" before "10"), then letters. */
export function compareIds(a: string, b: string): number {
  return collator.compare(a, b) || (a < b ? -1 : a > b ? 1 : 0);
}

/**
 * Which tags lie so far from the others that they are on no map: `lupin_twin/core/outlying.py`, which says
 * why, has the same rule. Both are held to the cases of `tests/twin/core/far_off.json`.
 */

/** A circle about the middle of the tags, metres; what is outside is far off. */
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

/** The middle value; of an even count the lower of the two, 0 of none. */
function medianLow(values: readonly number[]): number {
  const sorted = Float64Array.from(values).sort();
  return sorted[(sorted.length - 1) >> 1] ?? 0;
}
