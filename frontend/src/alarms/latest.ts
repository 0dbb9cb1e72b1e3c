/** Alarms with the latest values, whatever moment is shown. */
import type { Alarm, HealthReason, Verdict, WireTime } from '../contract/types';
import type { AppState } from '../store/app';
import { selectCatalogue, selectLatestHealth } from '../store/derived';
import { hourAgo, selectHourAgoNow, thenOf, type HourAgo } from '../store/hourAgo';
import { isBack, todoText, VERDICTS } from '../domain/health';
import { isReceivingNow, selectLatestTag } from '../store/moment';
import { inOrder, type Item } from './list';
import { alarmText, nowOf, reasonNow, type Now } from './words';

/** From when on alarms are known; null: not reported. */
export const selectKnownSince = ({ twin }: AppState): WireTime | null => twin.alarms?.since ?? null;

/** An alarm's value now, whatever moment is shown; null: it has no value. */
export function selectNow(
  state: AppState,
  alarm: Alarm,
  last: HourAgo | null = hourAgo.get(),
): Now | null {
  const tag = selectLatestTag(state, alarm.tag_id);
  const health = selectLatestHealth(state)?.byTag.get(alarm.tag_id);
  const before = tag ? thenOf(selectHourAgoNow(state, last), tag) : null;
  return nowOf(alarm, tag && health ? { tag, health } : null, before, isReceivingNow(state));
}

const reasonIn = (state: AppState, alarm: Alarm): HealthReason =>
  reasonNow(alarm, selectNow(state, alarm, null));

/** The worst current verdict of some alarms; null: no alarms. */
export function worstNow(state: AppState, items: readonly Item[]): Verdict | null {
  const verdicts = items.map(({ alarm }) => reasonIn(state, alarm).verdict);
  return VERDICTS.find((each) => verdicts.includes(each)) ?? null;
}

/** What to do first about some alarms that share a cause, by their current values. */
export function todoNow(state: AppState, items: readonly Item[]): string {
  const verdict = worstNow(state, items);
  const reasons = items.map(({ alarm }) => reasonIn(state, alarm));
  const worst = reasons.filter((reason) => reason.verdict === verdict);
  const first = worst.find((reason) => !isBack(reason)) ?? worst[0];
  return first ? todoText(first) : '';
}

/** Sorted as they are now, the worst first. */
export const worstNowFirst = (state: AppState, items: readonly Item[]): readonly Item[] =>
  inOrder(items, ({ alarm }) => reasonIn(state, alarm));

/** An alarm in one line, with its current value. */
export const textNow = (state: AppState, alarm: Alarm): string =>
  alarmText(alarm, selectCatalogue(state), selectNow(state, alarm));
