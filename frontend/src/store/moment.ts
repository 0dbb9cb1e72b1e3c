/**
 * What the page shows: a function of the received data and the requested moment. Table, card, legend,
 * map, notices and exports all read it here, so that they change moment together.
 */
import { now } from '../clock';
import type { StatusFrame } from '../contract/types';
import { endsNow, type Span, spanOf } from '../domain/time';
import { DAY_S } from '../domain/difference';
import { memoLast, memoOne } from '../domain/memo';
import type { Snapshot, Tag } from '../domain/twin';
import { S } from '../strings';
import { act, type AppState, store } from './app';
import type { House, Past, TwinState } from './twin';

export interface Shown extends House {
  /** Null: now. */
  readonly moment: number | null;
}

/**
 * Returns the same object for the same data and moment. While another past moment is being fetched,
 * the last one stays, with its own time. Data and moment come together, so that no data appear under
 * another time.
 */
export function shownAt(twin: TwinState, moment: number | null): Shown {
  if (moment === null || twin.past === null) return shownNow(twin.latest);
  const { at, house } = twin.past;
  return shownThen(house, twin.latest.map, at);
}

type ClockFault = keyof typeof S.clockTodo;

const isClockFault = (reason: unknown): reason is ClockFault =>
  typeof reason === 'string' && Object.hasOwn(S.clockTodo, reason);

type Clock = 'running' | 'paused' | 'unknown';

/** How the latest state ages, as far as known. */
function clockOf({ isTimeLost, connection, phase }: TwinState): Clock {
  const reason = connection.status?.reason;
  if (isTimeLost || isClockFault(reason)) return 'unknown';
  if (reason !== 'paused') return 'running';
  // Without a connection, the end of a pause would go unnoticed.
  return phase === 'live' ? 'paused' : 'unknown';
}

const shownNow = memoOne((house: House): Shown => ({ ...house, moment: null }));

const shownThen = memoLast((house: House, map: House['map'], moment: number): Shown => ({
  ...house,
  // The map has no history; walls and benches stay where they are.
  map,
  moment,
}));

export const selectShown = ({ twin, view }: AppState): Shown => shownAt(twin, view.moment);

/** Whether the current time is known, whatever is shown. */
export const selectHasTime = ({ twin }: AppState): boolean => clockOf(twin) !== 'unknown';

/** Why the twin has no valid time, although its data arrives; null: it has one, or is silent. */
export function selectClockFault({ twin: { phase, connection } }: AppState): ClockFault | null {
  const reason = connection.status?.reason;
  return phase === 'offline' && isClockFault(reason) ? reason : null;
}

/** The connection in a word. */
export const phaseWord = (state: AppState): string =>
  S.phase[selectClockFault(state) ? 'noTime' : state.twin.phase];

export const selectIsPaused = ({ twin }: AppState): boolean =>
  twin.connection.status?.reason === 'paused';

/** The latest state, whatever is shown: for the connection's status, and for what to fetch. */
export const selectLatest = ({ twin }: AppState): House => twin.latest;

export const selectPast = ({ twin }: AppState): Past | null => twin.past;

/** The requested moment if not shown yet, ROS seconds; else null. */
export function selectAwaited(state: AppState): number | null {
  const { moment } = state.view;
  return moment === null || selectShown(state).moment === moment ? null : moment;
}

/**
 * The twin's current time, ROS seconds, as far as known; `at` is the page's clock, ms. Null before
 * the first state, and if the twin has no time.
 */
export function rosNow({ twin }: AppState, at: number): number | null {
  const { snapshot } = twin.latest;
  if (!snapshot) return null;
  const taken = snapshot.at;
  if (taken === 0) return null;
  const goesOn = clockOf(twin) === 'running';
  return goesOn ? taken + Math.max(0, at - snapshot.takenAt) / 1000 : taken;
}

/** The same; null also if it is in doubt: then nothing has an age. */
export const latestTime = (state: AppState, at: number): number | null =>
  selectHasTime(state) ? rosNow(state, at) : null;

/** As of when ages are shown, ROS seconds: of now, or of the state at a past moment; null: unknown. */
export function shownTime(state: AppState, at: number): number | null {
  const { moment, snapshot } = selectShown(state);
  return moment === null ? latestTime(state, at) : (snapshot?.at ?? null);
}

/**
 * Whether the shown data are up to date: not at present if the twin is silent or disconnected. A past
 * moment does not depend on it.
 */
export const selectIsReceiving = (state: AppState): boolean =>
  selectShown(state).moment !== null || isReceivingNow(state);

/** Whether the bridge is unreachable: nothing arrives, and actions are not sent. */
export const selectIsDisconnected = ({ twin: { phase } }: AppState): boolean =>
  phase === 'stale' || phase === 'reconnecting';

export const isReceivingNow = ({ twin }: AppState): boolean =>
  twin.phase === 'live' && !twin.isTimeLost;

export const selectSnapshot = (state: AppState): Snapshot | null => selectShown(state).snapshot;

export const selectHasSnapshot = (state: AppState): boolean => selectSnapshot(state) !== null;

const NO_TAGS: readonly Tag[] = [];

export const selectTags = (state: AppState): readonly Tag[] =>
  selectSnapshot(state)?.tags ?? NO_TAGS;

const byId = memoOne(
  (tags: readonly Tag[]): ReadonlyMap<string, Tag> => new Map(tags.map((tag) => [tag.id, tag])),
);

export const selectTag = (state: AppState, tagId: string): Tag | undefined =>
  byId(selectTags(state)).get(tagId);

export const selectLatestTag = ({ twin }: AppState, tagId: string): Tag | undefined =>
  byId(twin.latest.snapshot?.tags ?? NO_TAGS).get(tagId);

/**
 * The origin of the twin's data if it must be shown; null: a real robot, or not reported. A played
 * recording shows nothing of the present.
 */
type Origin = Exclude<StatusFrame['origin'], 'robot' | 'unknown'> | null;

export function selectOrigin({ twin }: AppState): Origin {
  const origin = twin.lastStatus?.origin;
  return origin === 'simulated' || origin === 'recorded' || origin === 'sim_time' ? origin : null;
}

/** The length of the greenhouse's day, seconds of its time: short in a demo. */
export const selectDayS = ({ twin }: AppState): number => twin.lastStatus?.day_length_s ?? DAY_S;

export const selectIsRecorded = (state: AppState): boolean => selectOrigin(state) === 'recorded';

/** Whether the twin's time may differ from the time of day. */
export const selectHasOwnTime = (state: AppState): boolean =>
  selectIsRecorded(state) || selectOrigin(state) === 'sim_time';

/** The latest moment if it is not the time of day, ROS seconds; else null. */
export function ownTime(state: AppState, at: number): number | null {
  if (!selectHasOwnTime(state)) return null;
  // If the twin is silent, its last received time.
  return rosNow(state, isReceivingNow(state) ? at : -Infinity);
}

/** The span of the drawn timeline, without what is before the history; until one arrives, the period's. */
export function barSpan(state: AppState, nowS: number): Span {
  const { value } = state.twin.remembered;
  if (value && value.to > value.from) {
    const oldest = endsNow(state.view.period) ? (value.reach?.from ?? 0) : 0;
    return { from: Math.max(value.from, Math.min(oldest, value.to - 1)), to: value.to };
  }
  const { from, to } = spanOf(state.view.period, nowS, null);
  return { from, to: Math.max(to, from + 1) };
}

/** Whether it is known that nothing was recorded yet at that moment, ROS seconds. */
export const isBeforeAll = ({ twin }: AppState, at: number): boolean =>
  at < (twin.remembered.value?.reach?.from ?? 0);

/** The twin's current time, ROS seconds; null: not known. */
export const twinNow = (): number | null => rosNow(store.get(), now());

/** Label of the bar's end: in a recording, or while nothing arrives, it is not "now". */
export const latestWord = (): string => {
  const state = store.get();
  if (state.twin.phase !== 'live') return phaseWord(state);
  if (selectIsPaused(state)) return S.recordedIs.paused;
  return selectIsRecorded(state) ? S.origin.recorded : S.phase.live;
};

export function backToLive(): void {
  act({ moment: null });
}
