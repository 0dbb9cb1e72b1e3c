/**
 * What the page shows: a function of what came and of the moment to show. Table, card, legend,
 * map, notices and exports all ask here, so that another moment moves them all at once.
 */
import { now } from '../clock';
import type { StatusFrame } from '../contract/types';
import { type Ageing, AGES_UNKNOWN, GROWING, secondsOf, type Span, spanOf } from '../domain/time';
import { DAY_S } from '../domain/difference';
import { memoLast, memoOne } from '../domain/memo';
import type { Snapshot, Tag } from '../domain/twin';
import { S } from '../strings';
import { act, type AppState, store } from './app';
import type { House, Past, TwinState } from './twin';

export interface Shown extends House {
  /** Null: now. */
  readonly moment: number | null;
  readonly ageing: Ageing;
}

/**
 * The same object for the same data and moment. A moment in the past is that of the data: while
 * another one is on its way, the last that came stays, with its own time. Data and moment are told
 * in one, so that nothing can be taken for what it is not.
 */
export function shownAt(twin: TwinState, moment: number | null): Shown {
  if (moment === null || twin.past === null) return shownNow(twin.latest)(clockOf(twin));
  const { at, house } = twin.past;
  return shownThen(house, twin.latest.map, at);
}

const CLOCKS_LOST = new Set<unknown>(['no_clock', 'clock_stopped', 'clock_doubted']);

type Clock = 'running' | 'paused' | 'unknown';

/** How the time of the newest house goes on, as far as anybody knows. */
function clockOf({ isTimeLost, connection, phase }: TwinState): Clock {
  const reason = connection.status?.reason;
  if (isTimeLost || CLOCKS_LOST.has(reason)) return 'unknown';
  if (reason !== 'paused') return 'running';
  // Cut off, nobody hears that a pause is over.
  return phase === 'live' ? 'paused' : 'unknown';
}

const shownNow = memoOne((house: House) =>
  memoLast((clock: Clock): Shown => {
    // While the twin's time stands still, every age does.
    const ageing = { running: GROWING, unknown: AGES_UNKNOWN, paused: asTaken(house) }[clock];
    return { ...house, moment: null, ageing };
  }),
);

const asTaken = ({ snapshot }: House): Ageing => ({ kind: 'as-of', at: snapshot?.takenAt ?? 0 });

const shownThen = memoLast((house: House, map: House['map'], moment: number): Shown => ({
  ...house,
  // Of the map nobody keeps a past; walls and benches stay where they are.
  map,
  moment,
  // A past moment has one age a reading, however long it is looked at.
  ageing: asTaken(house),
}));

export const selectShown = ({ twin, view }: AppState): Shown => shownAt(twin, view.moment);

/** Whether anybody knows what time it is now, whatever is shown. */
export const selectHasTime = ({ twin }: AppState): boolean => clockOf(twin) !== 'unknown';

/** The newest there is, whatever is shown: for the connection's word, and for what to fetch. */
export const selectLatest = ({ twin }: AppState): House => twin.latest;

export const selectPast = ({ twin }: AppState): Past | null => twin.past;

/** The moment that is wanted and not shown yet, ROS seconds; null: what is shown is wanted. */
export function selectAwaited(state: AppState): number | null {
  const { moment } = state.view;
  return moment === null || selectShown(state).moment === moment ? null : moment;
}

/**
 * The twin's time now, ROS seconds, as far as anybody knows; `at` is the page's clock, ms. Null
 * before anything has come, and of a twin that has no time.
 */
export function rosNow({ twin }: AppState, at: number): number | null {
  const { snapshot } = twin.latest;
  if (!snapshot) return null;
  const taken = secondsOf(snapshot.at);
  if (taken === 0) return null;
  const goesOn = clockOf(twin) === 'running';
  return goesOn ? taken + Math.max(0, at - snapshot.takenAt) / 1000 : taken;
}

/**
 * Whether what is shown is heard of: the present of a twin that is silent, or cut off, is not. What
 * a past moment was like does not depend on it.
 */
export const selectIsReceiving = (state: AppState): boolean =>
  selectShown(state).moment !== null || isReceivingNow(state);

/** Whether the bridge does not answer: nothing comes, and nothing that is done here gets there. */
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
 * Where what the twin observed comes from, as it says, if that has to be told; null: a robot's, or of a twin
 * that does not say. A recording that is played is, in nothing, of now.
 */
type Origin = Exclude<StatusFrame['origin'], 'robot' | 'unknown'> | null;

export function selectOrigin({ twin }: AppState): Origin {
  const origin = twin.lastStatus?.origin;
  return origin === 'simulated' || origin === 'recorded' || origin === 'sim_time' ? origin : null;
}

/** How long a day of the greenhouse takes, seconds of its time: in a demo it is a short one. */
export const selectDayS = ({ twin }: AppState): number => twin.lastStatus?.day_length_s ?? DAY_S;

export const selectIsRecorded = (state: AppState): boolean => selectOrigin(state) === 'recorded';

/** Whether the twin's time may be another than that of the clock on the wall. */
export const selectHasOwnTime = (state: AppState): boolean =>
  selectIsRecorded(state) || selectOrigin(state) === 'sim_time';

/** The newest moment there is where that is not the time on the wall, ROS seconds; else null. */
export function ownTime(state: AppState, at: number): number | null {
  if (!selectHasOwnTime(state)) return null;
  // Of one that is silent, that which was heard last.
  return rosNow(state, isReceivingNow(state) ? at : -Infinity);
}

/** What is drawn is what was fetched; until then it is what was asked for. */
export function barSpan(state: AppState, nowS: number): Span {
  const { value } = state.twin.remembered;
  if (value && value.to > value.from) return value;
  const { from, to } = spanOf(state.view.period, nowS, null);
  return { from, to: Math.max(to, from + 1) };
}

/** The twin's time now, ROS seconds; null: nobody knows. */
export const twinNow = (): number | null => rosNow(store.get(), now());

/** What the end of the bar is called: of a recording it is no present, nor while nothing comes. */
export const latestWord = (): string => {
  const { phase } = store.get().twin;
  if (phase !== 'live') return S.phase[phase];
  return selectIsRecorded(store.get()) ? S.origin.recorded : S.timebarLive;
};

export function backToLive(): void {
  act({ moment: null });
}
