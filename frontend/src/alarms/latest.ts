/** Alarms with the latest values, whatever moment is shown. */
import type { Alarm, HealthReason, Verdict } from '../contract/types';
import type { AppState } from '../store/app';
import { selectCatalogue, selectLatestHealth } from '../store/derived';
import { hourAgo, selectHourAgoNow, thenOf, type HourAgo } from '../store/hourAgo';
import { airOf, isBack, todoText, VERDICTS } from '../domain/health';
import { groupedBy } from '../domain/memo';
import { isReceivingNow, selectLatestTag } from '../store/moment';
import { S } from '../strings';
import { causeOf, inOrder, type Item } from './list';
import { alarmText, nowOf, partsText, reasonNow, whereText, type Now } from './words';

/** From when on alarms are known; null: not reported. */
export const selectKnownSince = ({ twin }: AppState): number | null => twin.alarms?.since ?? null;

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

/** The current verdicts of some alarms, the worst first, and how many have each. */
export function countsNow(
  state: AppState,
  items: readonly Item[],
): readonly (readonly [Verdict, number])[] {
  const verdicts = items.map(({ alarm }) => reasonIn(state, alarm).verdict);
  return VERDICTS.map(
    (each) => [each, verdicts.filter((it) => it === each).length] as const,
  ).filter(([, count]) => count > 0);
}

/** The worst current verdict of some alarms; null: no alarms. */
export const worstNow = (state: AppState, items: readonly Item[]): Verdict | null =>
  countsNow(state, items)[0]?.[0] ?? null;

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

/** Most causes named in one message; the list has the rest. */
const MOST_NAMED = 3;

/** Alarms in one message with their current values, those of one cause at a tag together. */
export function severalNow(
  state: AppState,
  items: readonly Item[],
  say: (texts: readonly string[], more: number) => string,
  most = MOST_NAMED,
): string {
  const sensors = selectCatalogue(state);
  const current = (alarm: Alarm): Now | null => selectNow(state, alarm);
  const causes = groupedBy(items, ({ alarm }) => `${alarm.tag_id}|${causeOf(alarm, sensors)}`);
  const named = [...causes.values()].slice(0, most);
  const texts = named.map((own) => {
    const [{ alarm }] = own;
    const air = airOf(alarm.reason);
    if (!air || own.length === 1) return alarmText(alarm, sensors, current(alarm));
    const what = S.alarmWhat(S.airCause[air], partsText(own, sensors, current));
    return S.alarmWhat(whereText(alarm), what);
  });
  return say(texts, items.length - named.flat().length);
}
