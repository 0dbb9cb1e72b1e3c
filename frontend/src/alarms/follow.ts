/** Navigation from an alarm: to its tag live, and to the moment when it was raised. */
import { now } from '../clock';
import type { Alarm } from '../contract/types';
import { type Period, spanOf } from '../domain/time';
import { theMap } from '../map/commands';
import { act, store } from '../store/app';
import { rosNow } from '../store/moment';
import type { ViewState } from '../store/view';

/** Share of the time bar before the moment, so that the lead-up is visible too. */
const LEAD = 0.1;

/**
 * A period that contains the moment and some time before it. The current one if it does, else the last
 * hour, else the shortest one that reaches to now. All times in ROS seconds.
 */
export function periodWith(
  period: Period,
  at: number,
  nowS: number,
  oldest: number | null,
): Period {
  const has = (each: Period): boolean => {
    const { from, to } = spanOf(each, nowS, oldest);
    return at <= to && at - from >= (to - from) * LEAD;
  };
  const from = Math.max(0, Math.floor(at - ((nowS - at) * LEAD) / (1 - LEAD)));
  return (
    [period, { kind: 'hour' } as const].find(has) ?? { kind: 'own', from, to: Math.ceil(nowS) }
  );
}

/** Shows the tag live; on a narrow screen, its card covers the list until closed. */
export const showAlarm = (alarm: Alarm): void => {
  look(alarm, { moment: null, ...(alarm.tag_id === '' && { pane: 'map' }) });
};

/** Shows the moment when the alarm was raised. */
export function goToStart(alarm: Alarm): void {
  const nowS = rosNow(store.get(), now());
  const { period } = store.get().view;
  const oldest = store.get().twin.remembered.value?.reach?.from ?? null;
  // Round up to the millisecond: rounding down would miss the observation.
  const at = Math.ceil(alarm.raised_at * 1000) / 1000;
  if (nowS === null || at > nowS) return;
  look(alarm, { moment: at, period: periodWith(period, at, nowS, oldest), pane: 'map' });
}

function look(alarm: Alarm, when: Partial<Pick<ViewState, 'moment' | 'period' | 'pane'>>): void {
  const { view } = store.get();
  act({
    ...when,
    selected: alarm.tag_id || null,
    sensor: alarm.reason.sensor || view.sensor,
    chart: null,
    compare: null,
  });
  if (alarm.tag_id !== '') theMap.get()?.show(alarm.tag_id);
}
