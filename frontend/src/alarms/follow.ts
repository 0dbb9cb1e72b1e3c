/** The ways from an alarm: to its tag as it is now, and to the moment when it began. */
import { now } from '../clock';
import type { Alarm } from '../contract/types';
import { type Period, secondsOf, spanOf } from '../domain/time';
import { theMap } from '../map/commands';
import { act, store } from '../store/app';
import { rosNow } from '../store/moment';
import type { ViewState } from '../store/view';

/** Of the bar, what lies before the moment: how it came to it is to be seen as well. */
const LEAD = 0.1;

/**
 * The period that has the moment and something before it: the present one, else the last hour, else
 * one that just reaches from there to now.
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

/** Shows the tag as it is now; its card lies over the list, which is there again when it closes. */
export const showAlarm = (alarm: Alarm): void => {
  look(alarm, { moment: null, ...(alarm.tag_id === '' && { pane: 'map' }) });
};

/** Shows the moment when it began. */
export function goToStart(alarm: Alarm): void {
  const nowS = rosNow(store.get(), now());
  const { period } = store.get().view;
  const oldest = store.get().twin.remembered.value?.reach?.from ?? null;
  // To the millisecond that holds the observation, and not to the one before it.
  const at = Math.ceil(secondsOf(alarm.raised_at) * 1000) / 1000;
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
