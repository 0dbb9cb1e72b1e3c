/** Data from the server: the connection, the greenhouse, and what is fetched about it. */
import type {
  Alarms,
  Field,
  FieldQuality,
  Judgement,
  Latest,
  SensorsFile,
  StatusFrame,
} from '../contract/types';
import { INITIAL, phaseOf, type Connection, type Phase } from '../connection/machine';
import { sharedJudgement } from '../domain/health';
import { heldRange, type Range } from '../domain/ramp';
import type { Timeline } from '../domain/timeline';
import { snapshotOf, type Snapshot } from '../domain/twin';
import { NOTHING, type Fetched } from './fetcher';
import type { MapPicture } from '../geometry/image';

/** The greenhouse at one moment, and what is fetched about that moment. */
export interface House {
  readonly snapshot: Snapshot | null;
  /** The bridge's judgement of this state. */
  readonly health: Judgement | null;
  readonly field: Fetched<Field>;
  readonly map: Fetched<MapPicture>;
  readonly quality: FieldQuality | null;
  /** The range of the field's values, damped over successive fields. */
  readonly held: { readonly sensor: string; readonly range: Range } | null;
}

export const NO_HOUSE: House = {
  snapshot: null,
  health: null,
  field: NOTHING,
  map: NOTHING,
  quality: null,
  held: null,
};

export interface Past {
  /** The moment of the data, ROS seconds. */
  readonly at: number;
  /** Empty until the first answer. */
  readonly house: House;
}

interface PastFault {
  /** ROS seconds. */
  readonly at: number;
  readonly message: string;
  /** Retrying would not help: the moment is in the future. */
  readonly isLasting: boolean;
}

export interface Difference {
  /** Null: no tag had a position at the shown moment, which is then also `against`. */
  readonly field: Field | null;
  /** The moment that was shown, and the other one, ROS seconds. */
  readonly at: number;
  readonly against: number;
}

/** Snapshots are read only by `moment.ts`, which chooses what the page shows. */
export interface TwinState {
  readonly phase: Phase;
  readonly connection: Connection;
  /** The last status of a bridge that had received data: it describes what is shown. */
  readonly lastStatus: StatusFrame | null;
  /** Time has lapsed since the latest state, so its age is unknown. */
  readonly isTimeLost: boolean;
  /** Recent unreadable messages, and the fault of the last; null: none. */
  readonly unread: { readonly count: number; readonly why: string } | null;
  readonly latest: House;
  /** Alarms that are active or of the last day, whatever moment is shown; null: none received yet. */
  readonly alarms: Alarms | null;
  /** The last past moment received; null: the present is shown. */
  readonly past: Past | null;
  readonly pastFault: PastFault | null;
  /** The timeline of the period in view. */
  readonly remembered: Fetched<Timeline>;
  readonly difference: Fetched<Difference>;
  readonly sensors: Fetched<SensorsFile>;
}

export const NO_TWIN: TwinState = {
  phase: 'connecting',
  connection: INITIAL,
  lastStatus: null,
  isTimeLost: false,
  unread: null,
  latest: NO_HOUSE,
  alarms: null,
  past: null,
  pastFault: null,
  remembered: NOTHING,
  difference: NOTHING,
  sensors: NOTHING,
};

type With = (twin: TwinState) => Partial<TwinState>;

/** `now`: ms on the monotonic clock. */
export const withConnection =
  (connection: Connection, now: number): With =>
  (twin) => {
    const phase = phaseOf(connection, now);
    if (phase === twin.phase && sameToTheEye(connection, twin.connection)) return {};
    const { status } = connection;
    const lastStatus = status && status.reason !== 'never_seen' ? status : twin.lastStatus;
    return { phase, connection, lastStatus };
  };

/** `ageSeconds`: the state's age when sent, for the first one of a connection. */
export const withState =
  (latest: Latest, now: number, ageSeconds: number | null = null): With =>
  ({ isTimeLost, latest: last }) => {
    // `seq` is not compared: one socket delivers in order, and a restarted server counts anew.
    const arrivedAt = now - (ageSeconds ?? 0) * 1000;
    // After a lapse, the previous snapshot cannot date a repeated state.
    const before = isTimeLost ? null : last.snapshot;
    const snapshot = snapshotOf(latest, arrivedAt, before);
    const health = sharedJudgement(last.health, latest.health);
    return { latest: { ...last, snapshot, health }, isTimeLost: false };
  };

/** Counts a dropped message, with its reason. */
export const withUnread =
  (why: string): With =>
  ({ unread }) => ({ unread: { count: (unread?.count ?? 0) + 1, why } });

export const withLatest =
  (part: Partial<House>): With =>
  ({ latest }) => ({ latest: { ...latest, ...part } });

/** The error of the shown field. */
export const withQuality =
  (quality: FieldQuality | null): With =>
  ({ latest, past }) =>
    past
      ? { past: { ...past, house: { ...past.house, quality } } }
      : { latest: { ...latest, quality } };

export const withField =
  (field: Fetched<Field>): With =>
  ({ latest }) => ({ latest: { ...latest, field, held: heldAfter(latest.held, field.value) } });

/** The first past moment begins with the current colour range. */
export const withPast =
  (next: Past | null): With =>
  ({ past, latest }) => {
    const held = next && heldAfter(past?.house.held ?? latest.held, next.house.field.value);
    return { past: next && { at: next.at, house: { ...next.house, held } }, pastFault: null };
  };

function heldAfter(before: House['held'], field: Field | null): House['held'] {
  // An estimate without any known cell has no range, however many tags contribute.
  if (!field?.values.some((value) => !Number.isNaN(value))) return before;
  const { sensor, valueMin: low, valueMax: high } = field;
  const held = before?.sensor === sensor ? before.range : null;
  const range = heldRange(held, { low, high });
  return before && range === held ? before : { sensor, range };
}

/** Each frame moves the connection's clock; only other changes render. */
function sameToTheEye(a: Connection, b: Connection): boolean {
  return (
    a.epoch === b.epoch &&
    a.failures === b.failures &&
    a.socket.kind === b.socket.kind &&
    sameStatus(a.status, b.status)
  );
}

/** Ignores the state's age, which changes with every frame. */
const sameStatus = (a: StatusFrame | null, b: StatusFrame | null): boolean =>
  JSON.stringify({ ...a, state_age_seconds: null }) ===
  JSON.stringify({ ...b, state_age_seconds: null });
