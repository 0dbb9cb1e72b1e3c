/**
 * What the page shows: a function of what came and of the moment to show. Table, card, legend,
 * map, notices and exports all ask here, so that another moment moves them all at once.
 */
import { AGES_UNKNOWN, GROWING, type Ageing } from '../domain/age';
import type { Snapshot, Tag } from '../domain/twin';
import type { AppState } from './app';
import { memoLast, memoOne } from './memo';
import { NO_HOUSE, type House, type TwinState } from './twin';

/** The moment to show: null is now, a number a moment in the past, ROS seconds. */
export type Moment = number | null;

/** The greenhouse at the moment that is shown, and how its ages go on. */
export interface Shown extends House {
  readonly moment: Moment;
  readonly ageing: Ageing;
}

/** The same object for the same data and moment. A moment that is not here yet shows nothing. */
export function shownAt(twin: TwinState, moment: Moment): Shown {
  if (moment === null) return SHOWN_NOW[clockOf(twin)](twin.latest);
  return shownThen(twin.past?.at === moment ? twin.past.house : NO_HOUSE, moment);
}

/** How the time of the newest house goes on, as far as anybody knows. */
function clockOf({ isTimeLost, connection }: TwinState): keyof typeof SHOWN_NOW {
  const reason = connection.status?.reason;
  if (isTimeLost || reason === 'no_clock' || reason === 'clock_stopped') return 'unknown';
  return reason === 'paused' ? 'paused' : 'running';
}

const SHOWN_NOW = {
  running: memoOne((house: House): Shown => ({ ...house, moment: null, ageing: GROWING })),
  unknown: memoOne((house: House): Shown => ({ ...house, moment: null, ageing: AGES_UNKNOWN })),
  // The twin's time stands still, and with it every age.
  paused: memoOne((house: House): Shown => ({ ...house, moment: null, ageing: asTaken(house) })),
};

const asTaken = ({ snapshot }: House): Ageing => ({ kind: 'as-of', at: snapshot?.takenAt ?? 0 });

const shownThen = memoLast((house: House, moment: number): Shown => ({
  ...house,
  moment,
  // A past moment has one age a reading, however long it is looked at.
  ageing: asTaken(house),
}));

export const selectShown = ({ twin, view }: AppState): Shown => shownAt(twin, view.moment);

/** The newest there is, whatever is shown: for the connection's word, and for what to fetch. */
export const selectNewest = ({ twin }: AppState): House => twin.latest;

export const selectSnapshot = (state: AppState): Snapshot | null => selectShown(state).snapshot;

const NO_TAGS: readonly Tag[] = [];

export const selectTags = (state: AppState): readonly Tag[] =>
  selectSnapshot(state)?.tags ?? NO_TAGS;

const byId = memoOne(
  (tags: readonly Tag[]): ReadonlyMap<string, Tag> => new Map(tags.map((tag) => [tag.id, tag])),
);

export const selectTag = (state: AppState, tagId: string): Tag | undefined =>
  byId(selectTags(state)).get(tagId);
