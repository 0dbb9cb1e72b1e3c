/** Keeps the list of alarms up to date, whatever moment the page shows, and tells what is new. */
import { now, timeOfDay } from '../clock';
import type { Alarms } from '../contract/types';
import { onChange, store } from '../store/app';
import { createStore } from '../store/create';
import { rosNow } from '../store/moment';
import { nextEnd, pruned } from './kept';
import { EMPTY_LIST, listOf, newsOf, sharedList, type AlarmList, type News } from './list';
import { own } from './own';

/** The alarms of now. */
export const alarmList = createStore<AlarmList, AlarmList>(EMPTY_LIST, (_, next) => next);

type Listener = (news: News) => void;
const listeners = new Set<Listener>();

/** Calls back with what is new, once each; returns the way to stop. */
export function onNews(listener: Listener): () => void {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

/** What is resolved leaves the list so late at most, ms. */
const SWEEP_MS = 60_000;

export function startAlarms(): () => void {
  /** What was told of; null: nothing has come, and what comes first is no news. */
  let told: AlarmList | null = null;
  let looked = own.get();
  let timer: ReturnType<typeof setTimeout> | undefined;

  const look = (isOwnDoing: boolean): void => {
    clearTimeout(timer);
    const at = timeOfDay();
    const state = store.get();
    const { alarms } = state.twin;
    const kept = pruned(own.get(), idsOf(alarms), at);
    looked = kept;
    timer = setTimeout(look, Math.min(SWEEP_MS, (nextEnd(kept, at) ?? Infinity) - at), false);
    if (kept !== own.get()) own.dispatch(kept);
    if (!alarms) return;
    const list = listOf(alarms.alarms, kept, rosNow(state, now()), at);
    const news = told && !isOwnDoing ? newsOf(told, list) : null;
    // While the past is gone through, what is missing from the list is not resolved.
    if (alarms.source !== 'starting') told = list;
    alarmList.dispatch(sharedList(alarmList.get(), list));
    if (news && news.raised.length + news.cleared.length > 0) {
      for (const listener of [...listeners]) listener(news);
    }
  };
  const onAlarms = (): void => {
    look(false);
  };
  const onOwn = (): void => {
    if (looked !== own.get()) look(true);
  };
  look(true);
  const stops = [onChange(({ twin }) => [twin.alarms], onAlarms), own.subscribe(onOwn)];
  return () => {
    clearTimeout(timer);
    for (const stop of stops) stop();
    alarmList.dispatch(EMPTY_LIST);
  };
}

/** Until the past has been gone through nobody knows what is listed. */
const idsOf = (alarms: Alarms | null): ReadonlySet<string> =>
  new Set(alarms?.alarms.map(({ id }) => id));
