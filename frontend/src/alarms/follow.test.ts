import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import { theMap, type MapActions } from '../map/commands';
import { act, receive, store } from '../store/app';
import { withState } from '../store/twin';
import { withList, withTag } from '../store/view';
import { started } from '../testing/life';
import { alarm, reportAlarms } from '../testing/alarms';
import { showTags } from '../testing/page';
import { stateFrame, wireTag } from '../testing/tags';
import { goToStart, periodWith, showAlarm } from './follow';
import { NO_LOCAL_ALARMS, own } from './own';
import { calling } from './list';
import { alarmList, startAlarms } from './watch';

describe('period', () => {
  const NOW = 1_000_000;

  test.each([
    ['as it is', 'day', NOW - 3_600, { kind: 'day' }],
    ['the last hour', 'hour', NOW - 3_240, { kind: 'hour' }],
    [
      'from before it to now where it is longer ago',
      'hour',
      NOW - 9_000,
      { kind: 'own', from: NOW - 10_000, to: NOW },
    ],
    [
      'from the beginning where there is nothing before it',
      'hour',
      0,
      { kind: 'own', from: 0, to: NOW },
    ],
  ] as const)('%s', (_, kind, at, wanted) => {
    expect(periodWith({ kind }, at, NOW, null)).toEqual(wanted);
  });

  test('another where the present one ends before it', () => {
    expect(periodWith({ kind: 'own', from: 0, to: 10 }, NOW - 60, NOW, null).kind).toBe('hour');
  });
});

describe('follow', () => {
  const seen: string[] = [];
  let stops: (() => void)[];
  beforeEach(() => {
    vi.spyOn(performance, 'now').mockReturnValue(performance.now());
    seen.length = 0;
    own.set(NO_LOCAL_ALARMS);
    showTags([]);
    const latest = stateFrame([wireTag()], { sec: 10_000 });
    receive(withState(latest, performance.now()));
    stops = [started(startAlarms)];
    theMap.set({ show: (tagId) => void seen.push(tagId) } as MapActions);
  });
  afterEach(() => {
    for (const stop of stops) stop();
    vi.restoreAllMocks();
  });

  test('an alarm leads to its tag and sensor as they are now, and is not acknowledged by that', () => {
    const co2 = alarm('a', { tag_id: '5', raised: 9_000, reason: { sensor: 'co2' } });
    reportAlarms(co2);
    act({ compare: 'day' });
    act({ moment: 9_100 });
    act(withList('alarms'));
    showAlarm(co2);
    const { view } = store.get();
    expect(view).toMatchObject({ moment: null, selected: '5', sensor: 'co2', pane: 'tags' });
    expect(view).toMatchObject({ chart: null, compare: null });
    expect(seen).toEqual(['5']);
    expect(calling(alarmList.get())).toHaveLength(1);
  });

  test('its start is the moment of the observation that raised it, and no earlier', () => {
    const co2 = {
      ...alarm('a', { tag_id: '5', reason: { sensor: 'co2' } }),
      raised_at: 9_000.0012,
    };
    act(withList('alarms'));
    goToStart(co2);
    const { view } = store.get();
    expect(view).toMatchObject({ moment: 9_000.002, selected: '5', sensor: 'co2', pane: 'map' });
    expect(view.period).toEqual({ kind: 'day' });
    expect(seen).toEqual(['5']);
  });

  test('of the greenhouse it leads to the moment alone; there is none that has not come yet', () => {
    act(withTag('1'));
    const silent = alarm('a', {
      tag_id: '',
      raised: 9_500,
      reason: { kind: 'silent', sensor: '' },
    });
    act(withList('alarms'));
    showAlarm(silent);
    // Without a tag, no card opens.
    expect(store.get().view).toMatchObject({ moment: null, selected: null, pane: 'map' });
    goToStart(silent);
    expect(store.get().view).toMatchObject({
      moment: 9_500,
      selected: null,
      sensor: 'temperature',
    });
    expect(seen).toEqual([]);
    goToStart(alarm('b', { raised: 99_000 }));
    expect(store.get().view.moment).toBe(9_500);
  });
});
