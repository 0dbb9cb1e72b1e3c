/** In whose words alarms are told: the sensors in force, and the operator's unit; and of what state. */
import type { Alarm, Verdict } from '../contract/types';
import type { AppState } from '../store/app';
import { selectCatalogue, selectNewestHealth } from '../store/derived';
import { hourAgo, selectHourAgoNow, type HourAgo } from '../store/hourAgo';
import { VERDICTS } from '../domain/health';
import { memoLast } from '../domain/memo';
import { isHeardNow, selectNewestTag } from '../store/moment';
import type { Item } from './list';
import { nowOf, type Now } from './now';
import { alarmText, type Speech } from './words';

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
  const before = selectHourAgoNow(state, last)?.tags.get(alarm.tag_id) ?? null;
  return nowOf(alarm, tag && health ? { tag, health } : null, before, isHeardNow(state));
}

/** How bad it is now; null: nobody knows, or it has no value. */
export function verdictNow(state: AppState, alarm: Alarm): Verdict | null {
  const at = selectNow(state, alarm, null);
  return at?.kind === 'known' ? at.verdict : null;
}

/** The worst of some alarms as they are now, or as they were said last; null: there is none. */
export const worstNow = (state: AppState, items: readonly Item[]): Verdict | null =>
  VERDICTS.find((each) =>
    items.some(({ alarm, verdict }) => (verdictNow(state, alarm) ?? verdict) === each),
  ) ?? null;

/** An alarm in one line, as it is now. */
export const textNow = (state: AppState, alarm: Alarm): string =>
  alarmText(alarm, selectSpeech(state), selectNow(state, alarm));
