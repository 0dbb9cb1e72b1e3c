/** In whose words alarms are told: the sensors in force, and the operator's unit; and of what state. */
import type { Alarm, HealthReason, Verdict } from '../contract/types';
import type { AppState } from '../store/app';
import { selectCatalogue, selectNewestHealth } from '../store/derived';
import { hourAgo, selectHourAgoNow, thenOf, type HourAgo } from '../store/hourAgo';
import { todoText, VERDICTS } from '../domain/health';
import { memoLast } from '../domain/memo';
import { isHeardNow, selectNewestTag } from '../store/moment';
import { causesFirst, type Item } from './list';
import { alarmText, nowOf, reasonNow, type Now, type Speech } from './words';

const speech = memoLast((sensors: Speech['sensors'], unit: Speech['unit']): Speech => ({
  sensors,
  unit,
}));

export const selectSpeech = (state: AppState): Speech =>
  speech(selectCatalogue(state), state.settings.unit);

/** What an alarm is about as it is now, whatever moment is shown; null: there is no such value. */
export function selectNow(
  state: AppState,
  alarm: Alarm,
  last: HourAgo | null = hourAgo.get(),
): Now | null {
  const tag = selectNewestTag(state, alarm.tag_id);
  const health = selectNewestHealth(state)?.byTag.get(alarm.tag_id);
  const before = tag ? thenOf(selectHourAgoNow(state, last), tag, alarm.reason.sensor) : null;
  return nowOf(alarm, tag && health ? { tag, health } : null, before, isHeardNow(state));
}

const reasonIn = (state: AppState, alarm: Alarm): HealthReason =>
  reasonNow(alarm, selectNow(state, alarm, null));

/** The worst of some alarms as they are now; null: there is none. */
export function worstNow(state: AppState, items: readonly Item[]): Verdict | null {
  const verdicts = items.map(({ alarm }) => reasonIn(state, alarm).verdict);
  return VERDICTS.find((each) => verdicts.includes(each)) ?? null;
}

/** What to do first about some alarms of one cause, as they are now. */
export function todoNow(state: AppState, items: readonly Item[]): string {
  const verdict = worstNow(state, items);
  const todos = items
    .map(({ alarm }) => reasonIn(state, alarm))
    .filter((reason) => reason.verdict === verdict)
    .map(todoText);
  return todos.find((text) => text !== '') ?? '';
}

/** What is worst now first, many of one cause together. */
export function worstNowFirst(state: AppState, items: readonly Item[]): readonly Item[] {
  const reasons = new Map(items.map((item) => [item, reasonIn(state, item.alarm)]));
  return causesFirst(items, (item) => reasons.get(item) ?? item.alarm.reason, selectSpeech(state));
}

/** An alarm in one line, as it is now. */
export const textNow = (state: AppState, alarm: Alarm): string =>
  alarmText(alarm, selectSpeech(state), selectNow(state, alarm));
