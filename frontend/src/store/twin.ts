/** What came from the server: the connection, the greenhouse, and what is fetched about it. */
import type { Drop, Field, FieldQuality, Latest, StatusFrame } from '../contract/types';
import { INITIAL, phaseOf, type Connection, type Phase } from '../connection/machine';
import { snapshotOf, type Snapshot } from '../domain/twin';
import type { MapPicture } from './picture';

/** Something fetched beside the frames. While it is fetched again, the old value stays. */
export interface Fetched<T> {
  readonly value: T | null;
  readonly state: 'waiting' | 'ready' | 'failed';
  /** Why it failed, for a person to read. */
  readonly message: string;
}

export const NOTHING: Fetched<never> = { value: null, state: 'waiting', message: '' };

/** The greenhouse as it was or is at one moment, and what is fetched about that moment. */
export interface House {
  readonly snapshot: Snapshot | null;
  readonly field: Fetched<Field>;
  readonly map: Fetched<MapPicture>;
  readonly quality: FieldQuality | null;
}

export const NO_HOUSE: House = { snapshot: null, field: NOTHING, map: NOTHING, quality: null };

/** Read by `moment.ts` alone, which chooses what the page shows; everyone else asks there. */
export interface TwinState {
  readonly phase: Phase;
  readonly connection: Connection;
  /** Time has lapsed since the newest state: how old it is nobody knows. */
  readonly isTimeLost: boolean;
  /** Messages of late that were no frames, and what was wrong with the last; null: none. */
  readonly unread: { readonly count: number; readonly why: string } | null;
  /** As the frames tell it. */
  readonly latest: House;
  /** As it was at another moment, ROS seconds; null: nobody has asked. */
  readonly past: { readonly at: number; readonly house: House } | null;
}

export const NO_TWIN: TwinState = {
  phase: 'connecting',
  connection: INITIAL,
  isTimeLost: false,
  unread: null,
  latest: NO_HOUSE,
  past: null,
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
  | { readonly type: 'map'; readonly map: Fetched<MapPicture> }
  | { readonly type: 'quality'; readonly quality: FieldQuality | null }
  | { readonly type: 'past'; readonly past: TwinState['past'] };

export function reduceTwin(state: TwinState, action: TwinAction): TwinState {
  switch (action.type) {
    case 'connection': {
      const phase = phaseOf(action.connection, action.now);
      if (phase === state.phase && sameToTheEye(action.connection, state.connection)) return state;
      return { ...state, phase, connection: action.connection };
    }
    case 'state': {
      // No comparison of seq: one socket delivers in order, and a restarted server counts anew.
      const arrivedAt = action.now - (action.stateAgeSeconds ?? 0) * 1000;
      // What was there before a lapse says nothing about how old a state that is sent again is.
      const before = state.isTimeLost ? null : state.latest.snapshot;
      const snapshot = snapshotOf(action.latest, arrivedAt, before);
      return withLatest({ ...state, isTimeLost: false }, { snapshot });
    }
    case 'lapse':
      return { ...state, isTimeLost: true };
    case 'unread': {
      const { why } = action;
      const count = (state.unread?.count ?? 0) + 1;
      return { ...state, unread: why === null ? null : { count, why } };
    }
    case 'field':
      return withLatest(state, { field: action.field });
    case 'map':
      return withLatest(state, { map: action.map });
    case 'quality':
      return withLatest(state, { quality: action.quality });
    case 'past':
      return { ...state, past: action.past };
  }
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

const sameStatus = (a: StatusFrame | null, b: StatusFrame | null): boolean =>
  a?.twin === b?.twin &&
  a?.reason === b?.reason &&
  a?.message === b?.message &&
  a?.has_map === b?.has_map &&
  sameDrops(a?.drops ?? [], b?.drops ?? []);

const sameDrops = (a: readonly Drop[], b: readonly Drop[]): boolean =>
  a.length === b.length &&
  a.every(
    ({ reason, message, count }, index) =>
      b[index]?.reason === reason && b[index].message === message && b[index].count === count,
  );
