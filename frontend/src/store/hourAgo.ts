/** The house an hour before what is shown, for the table's trends: one question now and then. */
import { now } from '../clock';
import { fetchStateAt } from '../contract/past';
import type { TagHealth } from '../contract/types';
import { secondsOf } from '../domain/rostime';
import { TREND_S, type TagThen } from '../domain/trend';
import { snapshotOf } from '../domain/twin';
import { store, type AppState } from './app';
import { createStore } from './create';
import { rosNow, selectNewest, selectShown, selectSnapshot } from './moment';
import { isColumnShown } from './settings';

/** An answer serves for so long, seconds of the twin's time: less than anybody sees in a trend. */
const SERVES_S = 300;
/** After a question without an answer, ms. */
const RETRY_MS = 60_000;
/** Whoever drags through time is not asked for at each step, ms. */
const SETTLE_MS = 600;

export interface HourAgo {
  /** The moment that it lies an hour before, ROS seconds. */
  readonly of: number;
  readonly tags: ReadonlyMap<string, TagThen>;
}

export const hourAgo = createStore<HourAgo | null, HourAgo | null>(null, (_, next) => next);

const NOT_JUDGED: TagHealth = { verdict: 'unknown', reasons: [] };

const serves = (of: number, base: number, isPast: boolean): boolean =>
  Math.abs(base - of) <= (isPast ? 1 : SERVES_S);

/** The moment that is shown, ROS seconds; null: there is none yet. */
const baseOf = (state: AppState): number | null =>
  selectShown(state).moment ?? rosNow(state, now());

/** What was known an hour before what is shown, by the state's own stamp; null: not known. */
export function selectHourAgo(state: AppState, last: HourAgo | null): HourAgo | null {
  const { moment } = selectShown(state);
  const snapshot = selectSnapshot(state);
  const base = moment ?? (snapshot && secondsOf(snapshot.at));
  // Now it may be twice as old as it serves: the next answer is on its way.
  if (!last || base === null) return null;
  return Math.abs(base - last.of) <= (moment === null ? 2 * SERVES_S : 1) ? last : null;
}

/** What was known an hour before now, whatever moment is shown; null: not known. */
export function selectHourAgoNow(state: AppState, last: HourAgo | null): HourAgo | null {
  const { snapshot } = selectNewest(state);
  return snapshot && last && Math.abs(secondsOf(snapshot.at) - last.of) <= 2 * SERVES_S
    ? last
    : null;
}

export function startHourAgo(): () => void {
  let asking: AbortController | null = null;
  let asked: number | null = null;
  let notBefore = 0;
  let settling: ReturnType<typeof setTimeout> | undefined;
  let waitingFor: number | 'now' | null = null;

  const ask = (base: number): void => {
    asking?.abort();
    const mine = new AbortController();
    asking = mine;
    asked = base;
    fetchStateAt(Math.max(0, base - TREND_S), mine.signal).then(
      (latest) => {
        if (mine.signal.aborted) return;
        asking = null;
        const { tags } = snapshotOf(latest, 0, null);
        const known = tags.map((tag): [string, TagThen] => [
          tag.id,
          { tag, health: latest.health.tags[tag.id] ?? NOT_JUDGED },
        ]);
        hourAgo.dispatch({ of: base, tags: new Map(known) });
      },
      () => {
        if (mine.signal.aborted) return;
        asking = null;
        // A twin without a past stays without: it is asked again, and nobody is told.
        notBefore = now() + RETRY_MS;
      },
    );
  };

  const rest = (): void => {
    clearTimeout(settling);
    waitingFor = null;
  };

  const update = (): void => {
    const state = store.get();
    const base = baseOf(state);
    const isPast = selectShown(state).moment !== null;
    const serving = [hourAgo.get()?.of, asking ? asked : null].some(
      (of) => of != null && base !== null && serves(of, base, isPast),
    );
    const isSeen = isColumnShown(state.settings, 'trend') || state.view.list === 'alarms';
    const isWanted = base !== null && base >= TREND_S && isSeen;
    if (!isWanted || serving) {
      rest();
      return;
    }
    const wish = isPast ? base : 'now';
    // A frame a second puts nothing off; another moment does.
    if (wish === waitingFor) return;
    rest();
    waitingFor = wish;
    const wait = Math.max(isPast ? SETTLE_MS : 0, notBefore - now());
    settling = setTimeout(() => {
      waitingFor = null;
      const later = baseOf(store.get());
      if (later !== null) ask(later);
    }, wait);
  };

  update();
  const stop = store.subscribe(update);
  return () => {
    stop();
    rest();
    asking?.abort();
    hourAgo.dispatch(null);
  };
}
