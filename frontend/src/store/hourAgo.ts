/** The greenhouse an hour before the shown moment, for the table's trends; fetched rarely. */
import { now } from '../clock';
import { fetchStateAt } from '../contract/past';
import { hourText, type TagThen } from '../domain/difference';
import { snapshotOf, type Tag } from '../domain/twin';
import { keepFetched, store, type AppState } from './app';
import { createStore, PAGE } from './create';
import type { FetchTask } from './fetcher';
import { rosNow, selectDayS, selectLatest, selectShown } from './moment';
import { isColumnShown } from './settings';
import { NOT_JUDGED } from '../domain/health';

/** An hour of the greenhouse's day, seconds of the twin's time: a demo has short days. */
const selectHourS = (state: AppState): number => selectDayS(state) / 24;

/** The length of the greenhouse's hour if shorter than a real hour; else null. */
export const shortHourText = (): string | null => hourText(selectHourS(store.get()));

/** Cache TTL as a share of an hour: too short to show in a trend. */
const SERVES = 1 / 12;
/** Pace, ms: dragging through time must not fetch at each step. */
const PACE_MS = 1_000;

export interface HourAgo {
  /** One hour after the answer's moment, ROS seconds. */
  readonly of: number;
  readonly tags: ReadonlyMap<string, TagThen>;
}

export const hourAgo = createStore<HourAgo | null>(null);

/** The state an hour before the shown one, by the state's stamp; null: not known. */
export function selectHourAgo(state: AppState, last: HourAgo | null): HourAgo | null {
  const { moment } = selectShown(state);
  if (moment === null) return selectHourAgoNow(state, last);
  return last && Math.abs(moment - last.of) <= 1 ? last : null;
}

/** The state an hour before now, whatever moment is shown; null: not known. */
export function selectHourAgoNow(state: AppState, last: HourAgo | null): HourAgo | null {
  const { snapshot } = selectLatest(state);
  if (!last || !snapshot) return null;
  // Valid for twice the TTL: the next answer is on its way.
  const isNear = Math.abs(snapshot.at - last.of) <= 2 * SERVES * selectHourS(state);
  return isNear ? last : null;
}

/** What a tag is compared with. */
export const thenOf = (last: HourAgo | null, tag: Tag): TagThen | null =>
  last?.tags.get(tag.id) ?? null;

export function startHourAgo(signal = PAGE): void {
  const taskFor = (state: AppState): FetchTask<HourAgo> | null => {
    const { moment } = selectShown(state);
    const hourS = selectHourS(state);
    const base = moment ?? rosNow(state, now());
    const isSeen = isColumnShown(state.settings, 'trend') || state.view.list === 'alarms';
    // The bridge's status has the length of a day, and so of an hour.
    const hasStatus = state.twin.connection.status !== null;
    if (base === null || base < hourS || !isSeen || !hasStatus) return null;
    return {
      key: moment === null ? `now ${Math.floor(base / (SERVES * hourS))}` : `at ${moment}`,
      run: (on) =>
        fetchStateAt(base - hourS, on).then((latest) => {
          const { tags } = snapshotOf(latest, 0, null);
          const known = tags.map((tag): [string, TagThen] => [
            tag.id,
            { tag, health: latest.health.tags[tag.id] ?? NOT_JUDGED },
          ]);
          return { of: base, tags: new Map(known) };
        }),
    };
  };
  // On failure, the table and the alarms show no trend.
  keepFetched<HourAgo>({ paceMs: PACE_MS, onValue: hourAgo.set }, taskFor, signal);
  signal.addEventListener('abort', () => hourAgo.set(null));
}
