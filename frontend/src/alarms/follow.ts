/** The way from an alarm to its tag on the map and its moment on the time bar. */
import { now } from '../clock';
import { spanOf, type Period } from '../domain/period';
import { secondsOf } from '../domain/rostime';
import { commandMap } from '../map/commands';
import { act, store } from '../store/app';
import { rosNow } from '../store/moment';
import type { Item } from './list';
import { seeAlarms } from './own';

/** Of the bar, what lies before the moment: how it came to it is to be seen as well. */
const LEAD = 0.1;
const DAY_S = 86_400;

/** The period that has the moment and something before it: the present one, else the shortest. */
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
  const kinds = ['hour', 'day', 'week', 'month'] as const;
  const fitting = [period, ...kinds.map((kind): Period => ({ kind }))].find(has);
  return fitting ?? { kind: 'own', from: Math.max(0, at - DAY_S / 2), to: at + DAY_S / 2 };
}

/** Leads there, and counts as seen: whoever goes there has seen it. */
export function followAlarm(item: Item): void {
  const { alarm } = item;
  const { view, twin } = store.get();
  const nowS = rosNow(store.get(), now());
  const { sensor } = alarm.reason;
  // To the millisecond that holds the observation, and not to the one before it.
  const at = Math.ceil(secondsOf(alarm.raised_at) * 1000) / 1000;
  const canLookBack = nowS !== null && at <= nowS && twin.remembered.state !== 'off';
  const oldest = twin.remembered.value?.reach?.from ?? null;
  act({
    type: 'look',
    view: {
      moment: canLookBack ? at : null,
      period: canLookBack ? periodWith(view.period, at, nowS, oldest) : view.period,
      selected: alarm.tag_id || null,
      sensor: sensor || view.sensor,
      chart: null,
      compare: null,
      pane: 'map',
    },
  });
  if (alarm.tag_id !== '') commandMap({ type: 'show', tagId: alarm.tag_id });
  seeAlarms([item]);
}
