/**
 * Keeps the alarm list up to date, whatever moment the page shows. Announces changes to the page, its
 * title and screen readers.
 */
import { now, timeOfDay } from '../clock';
import type { Alarms } from '../contract/types';
import { rosText } from '../domain/time';
import { type AppState, onChange, store } from '../store/app';
import { announce, createStore, createVoice, PAGE } from '../store/create';
import { rosNow, selectIsDisconnected, selectIsRecorded, selectShown } from '../store/moment';
import { S } from '../strings';
import { nextEnd, own, pruned, startOwn } from './own';
import {
  calling,
  countText,
  EMPTY_LIST,
  listOf,
  newsOf,
  sharedList,
  type AlarmList,
  type Item,
  type News,
} from './list';
import { severalNow } from './latest';

/** The current alarms. */
export const alarmList = createStore<AlarmList>(EMPTY_LIST);

const news = createStore<News>({ raised: [], cleared: [] });

/** Calls `listener` once per change. */
export function onNews(listener: (news: News) => void, signal: AbortSignal): void {
  news.subscribe(() => listener(news.get()), signal);
}

/** Longest delay before an expired resolved alarm leaves the list, ms. */
const SWEEP_MS = 60_000;

export function startAlarms(signal = PAGE): void {
  /** The list last announced; null: none received yet, and the first one is no news. */
  let announced: AlarmList | null = null;
  let checked = own.get();
  let timer: ReturnType<typeof setTimeout> | undefined;

  const update = (isOwnDoing: boolean): void => {
    clearTimeout(timer);
    const at = timeOfDay();
    const state = store.get();
    const { alarms } = state.twin;
    const local = pruned(own.get(), idsOf(alarms), at);
    checked = local;
    timer = setTimeout(update, Math.min(SWEEP_MS, nextEnd(local, at) - at), false);
    if (local !== own.get()) own.set(local);
    if (!alarms) return;
    const list = listOf(alarms.alarms, local, rosNow(state, now()), at);
    const found = announced && !isOwnDoing ? newsOf(announced, list) : null;
    // While the bridge replays the past, alarms missing from the list are not resolved.
    if (alarms.source !== 'starting') announced = list;
    alarmList.set(sharedList(alarmList.get(), list));
    if (found && found.raised.length + found.cleared.length > 0) news.set(found);
  };
  const onAlarms = (): void => update(false);
  const onOwn = (): void => {
    if (checked !== own.get()) update(true);
  };
  update(true);
  onChange(({ twin }) => [twin.alarms], onAlarms, signal);
  own.subscribe(onOwn, signal);
  signal.addEventListener('abort', () => {
    clearTimeout(timer);
    alarmList.set(EMPTY_LIST);
  });
}

/** Ids of the listed alarms; null: not known, or not yet all. */
const idsOf = (alarms: Alarms | null): ReadonlySet<string> | null =>
  alarms && alarms.source !== 'starting' ? new Set(alarms.alarms.map(({ id }) => id)) : null;

/** Alarms raised while a past moment is shown that still need attention (`calling`), the worst first. */
export const meanwhile = createStore<readonly Item[]>([]);

/** Ids of all that were raised since the past is shown. */
let ids: ReadonlySet<string> = new Set();

/** They have been read; later ones are listed again. */
export function dismissMeanwhile(): void {
  ids = new Set();
  meanwhile.set([]);
}

export function startMeanwhile(signal = PAGE): void {
  const update = (): void => {
    if (store.get().view.moment === null) ids = new Set();
    const before = meanwhile.get();
    const next = calling(alarmList.get()).filter(({ alarm }) => ids.has(alarm.id));
    const isSame = next.length === before.length && next.every((it, at) => it === before[at]);
    if (!isSame) meanwhile.set(next);
  };
  onNews(({ raised }) => {
    if (store.get().view.moment === null) return;
    ids = new Set([...ids, ...raised.map(({ alarm }) => alarm.id)]);
    update();
  }, signal);
  alarmList.subscribe(update, signal);
  store.subscribe(update, signal);
  update();
}

/** The page title: number of active alarms, a note on the connection, and the shown moment. */
export const titleOf = (count: string, moment: number | null, note = ''): string => {
  const shown = moment === null ? S.product : S.pastTitle(rosText(moment));
  const title = note === '' ? shown : `${note} · ${shown}`;
  return count === '0' ? title : `(${count}) ${title}`;
};

/** In the background, a disconnected tab would look as if it had no alarms. */
const noteOf = (state: AppState): string | undefined =>
  selectIsDisconnected(state)
    ? S.phase[state.twin.phase]
    : selectIsRecorded(state)
      ? S.origin.recorded
      : undefined;

/** Keeps the page title up to date. */
export function startTitle(signal = PAGE): void {
  const update = (): void => {
    const state = store.get();
    const { moment } = selectShown(state);
    const title = titleOf(countText(alarmList.get(), 'active'), moment, noteOf(state));
    if (document.title !== title) document.title = title;
  };
  update();
  store.subscribe(update, signal);
  alarmList.subscribe(update, signal);
}

/** For screen readers: waits for the current speech to end. */
export const politeVoice = createVoice();
/** For screen readers: interrupts. */
export const urgentVoice = createVoice();

function newsText({ raised, cleared }: News): string {
  const text = (
    items: readonly Item[],
    say: (texts: readonly string[], more: number) => string,
  ): string[] => (items.length === 0 ? [] : [severalNow(store.get(), items, say)]);
  return [...text(raised, S.alarmsRaised), ...text(cleared, S.alarmsCleared)].join('. ');
}

/** Announces changes to screen readers. */
export const startVoices = (signal = PAGE): void =>
  onNews((found) => {
    const isUrgent = found.raised.some(({ alarm }) => alarm.reason.verdict === 'critical');
    announce(isUrgent ? urgentVoice : politeVoice, newsText(found));
  }, signal);

export function startAlarmsAndAnnouncements(
  storage: Pick<Storage, 'getItem' | 'setItem'>,
  signal = PAGE,
): void {
  // Stored state first, so that alarms acknowledged on an earlier visit are not announced.
  startOwn(storage, signal);
  for (const start of [startAlarms, startTitle, startVoices, startMeanwhile]) start(signal);
}
