/** What came from the server: the connection, the greenhouse, and what is fetched about it. */
import type {
  Alarms,
  Field,
  FieldQuality,
  Judgement,
  Latest,
  StatusFrame,
} from '../contract/types';
import { INITIAL, phaseOf, type Connection, type Phase } from '../connection/machine';
import { sharedJudgement } from '../domain/health';
import type { Catalogues } from '../domain/sensors';
import { heldRange, type Range } from '../domain/ramp';
import type { Timeline } from '../domain/timeline';
import { snapshotOf, type Snapshot } from '../domain/twin';
import { NOTHING, type Fetched } from './fetcher';
import type { MapPicture } from '../geometry/image';

/** The greenhouse as it was or is at one moment, and what is fetched about that moment. */
export interface House {
  readonly snapshot: Snapshot | null;
  /** What the bridge said of that very state. */
  readonly health: Judgement | null;
  readonly field: Fetched<Field>;
  readonly map: Fetched<MapPicture>;
  readonly quality: FieldQuality | null;
  /** The range of the field's values, held calm over the fields before it. */
  readonly held: Held | null;
}

interface Held {
  readonly sensor: string;
  readonly range: Range;
}

export const NO_HOUSE: House = {
  snapshot: null,
  health: null,
  field: NOTHING,
  map: NOTHING,
  quality: null,
  held: null,
};

/** What was fetched about a moment in the past. */
export interface Past {
  /** The moment that the data are of, ROS seconds. */
  readonly at: number;
  /** Empty while nothing has come. */
  readonly house: House;
}

/** Why a moment that was asked for is not here. */
interface PastFault {
  /** ROS seconds. */
  readonly at: number;
  readonly message: string;
  /** Asking again would not help: nothing is kept, or the moment has not come. */
  readonly isLasting: boolean;
}

/** What is remembered of the period in view; "off": this twin remembers nothing. */
export interface Remembered {
  readonly value: Timeline | null;
  readonly state: 'waiting' | 'ready' | 'failed' | 'off';
  readonly message: string;
}

/** The field of one moment less that of another. */
export interface Difference {
  /** Null: nothing is known of the other moment. */
  readonly field: Field | null;
  /** The moment that was shown, and the other one, ROS seconds. */
  readonly at: number;
  readonly against: number;
}

export const NOT_ASKED: Remembered = { value: null, state: 'waiting', message: '' };

/** Read by `moment.ts` alone, which chooses what the page shows; everyone else asks there. */
export interface TwinState {
  readonly phase: Phase;
  readonly connection: Connection;
  /** The last one of a bridge that has received something: it is about what is shown. */
  readonly lastStatus: StatusFrame | null;
  /** Time has lapsed since the newest state: how old it is nobody knows. */
  readonly isTimeLost: boolean;
  /** Messages of late that were no frames, and what was wrong with the last; null: none. */
  readonly unread: { readonly count: number; readonly why: string } | null;
  /** As the frames tell it. */
  readonly latest: House;
  /** The alarms of now and of the last day, whatever moment is shown; null: none were told of yet. */
  readonly alarms: Alarms | null;
  /** As it was at the last moment in the past that has come; null: nobody looks back. */
  readonly past: Past | null;
  readonly pastFault: PastFault | null;
  readonly remembered: Remembered;
  /** What the heat map is when it is compared. */
  readonly difference: Fetched<Difference>;
  /** The file of sensors that is in force. */
  readonly sensors: Fetched<Catalogues>;
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
  remembered: NOT_ASKED,
  difference: NOTHING,
  sensors: NOTHING,
};

export type TwinAction =
  | { readonly type: 'connection'; readonly connection: Connection; readonly now: number }
  | {
      readonly type: 'state';
      readonly latest: Latest;
      readonly now: number;
      /** Set on the first frame of a connection: how old the state was when it was sent. */
      readonly stateAgeSeconds?: number | null;
    }
  /** The machine slept, or its clock was set. */
  | { readonly type: 'lapse' }
  /** A message was dropped, for this reason; null: that was long ago. */
  | { readonly type: 'unread'; readonly why: string | null }
  | { readonly type: 'field'; readonly field: Fetched<Field> }
  | { readonly type: 'latest'; readonly part: Partial<Pick<House, 'map' | 'quality'>> }
  | { readonly type: 'past'; readonly past: Past | null }
  /** What nothing else follows from. */
  | { readonly type: 'set'; readonly part: Partial<Pick<TwinState, Plain>> };

type Plain = 'alarms' | 'pastFault' | 'remembered' | 'difference' | 'sensors';

export function reduceTwin(state: TwinState, action: TwinAction): TwinState {
  switch (action.type) {
    case 'connection': {
      const phase = phaseOf(action.connection, action.now);
      if (phase === state.phase && sameToTheEye(action.connection, state.connection)) return state;
      const { status } = action.connection;
      const lastStatus = status && status.reason !== 'never_seen' ? status : state.lastStatus;
      return { ...state, phase, connection: action.connection, lastStatus };
    }
    case 'state': {
      // No comparison of seq: one socket delivers in order, and a restarted server counts anew.
      const arrivedAt = action.now - (action.stateAgeSeconds ?? 0) * 1000;
      // What was there before a lapse says nothing about how old a state that is sent again is.
      const before = state.isTimeLost ? null : state.latest.snapshot;
      const snapshot = snapshotOf(action.latest, arrivedAt, before);
      const health = sharedJudgement(state.latest.health, action.latest.health);
      return withLatest({ ...state, isTimeLost: false }, { snapshot, health });
    }
    case 'lapse':
      return { ...state, isTimeLost: true };
    case 'unread': {
      const { why } = action;
      const count = (state.unread?.count ?? 0) + 1;
      return { ...state, unread: why === null ? null : { count, why } };
    }
    case 'field':
      return withLatest(state, {
        field: action.field,
        held: heldAfter(state.latest.held, action.field.value),
      });
    case 'latest':
      return withLatest(state, action.part);
    case 'past':
      return { ...state, past: action.past && heldPast(state, action.past), pastFault: null };
    case 'set':
      return { ...state, ...action.part };
  }
}

function heldAfter(before: Held | null, field: Field | null): Held | null {
  // Of an estimate that knows nothing there is no range, however many tags contribute.
  if (!field?.values.some((value) => !Number.isNaN(value))) return before;
  const { sensor, valueMin: low, valueMax: high } = field;
  const held = before?.sensor === sensor ? before.range : null;
  const range = heldRange(held, { low, high });
  return before && range === held ? before : { sensor, range };
}

/** Whoever drags through time begins with the colours of now. */
function heldPast({ past, latest }: TwinState, { at, house }: Past): Past {
  const before = past?.house.held ?? latest.held;
  return { at, house: { ...house, held: heldAfter(before, house.field.value) } };
}

const withLatest = (state: TwinState, part: Partial<House>): TwinState => ({
  ...state,
  latest: { ...state.latest, ...part },
});

/** Each frame moves the connection's clock; only the rest is worth a render. */
function sameToTheEye(a: Connection, b: Connection): boolean {
  return (
    a.epoch === b.epoch &&
    a.failures === b.failures &&
    a.socket.kind === b.socket.kind &&
    sameStatus(a.status, b.status)
  );
}

/** The age of the twin's state is told beside it, and goes on with every frame. */
const sameStatus = (a: StatusFrame | null, b: StatusFrame | null): boolean =>
  JSON.stringify({ ...a, state_age_seconds: null }) ===
  JSON.stringify({ ...b, state_age_seconds: null });
