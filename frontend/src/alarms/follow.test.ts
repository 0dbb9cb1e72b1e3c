import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import { onMapCommand } from '../map/commands';
import { act, receive, store } from '../store/app';
import { NOT_ASKED } from '../store/twin';
import { alarm, tellAlarms } from '../testing/alarms';
import { showTags } from '../testing/page';
import { stateFrame, wireTag } from '../testing/tags';
import { followAlarm, periodWith } from './follow';
import { NOTHING_KEPT } from './kept';
import { calling } from './list';
import { own } from './own';
import { alarmList, startAlarms } from './watch';

describe('period', () => {
  const NOW = 1_000_000;

  test.each([
    ['as it is', 'day', NOW - 3_600, { kind: 'day' }],
    ['the last hour', 'hour', NOW - 3_240, { kind: 'hour' }],
    ['longer: before it there is next to nothing', 'hour', NOW - 3_241, { kind: 'day' }],
    ['a week', 'hour', NOW - 86_400, { kind: 'week' }],
    ['a month', 'hour', NOW - 700_000, { kind: 'month' }],
  ] as const)('%s', (_, kind, at, wanted) => {
    expect(periodWith({ kind }, at, NOW, null)).toEqual(wanted);
  });

  test('one of its own where none reaches that far, or that ends before it', () => {
    expect(periodWith({ kind: 'hour' }, 4_000_000, 9_000_000, null)).toEqual({
      kind: 'own',
      from: 3_956_800,
      to: 4_043_200,
    });
    expect(periodWith({ kind: 'own', from: 0, to: 10 }, NOW - 60, NOW, null).kind).toBe('hour');
    expect(periodWith({ kind: 'own', from: 0, to: 10 }, 5, NOW, null).kind).toBe('own');
  });
});

describe('follow', () => {
  const commands: unknown[] = [];
  let stops: (() => void)[];
  beforeEach(() => {
    vi.spyOn(performance, 'now').mockReturnValue(performance.now());
    commands.length = 0;
    own.dispatch(NOTHING_KEPT);
    showTags([]);
    const latest = stateFrame([wireTag()], { sec: 10_000 });
    receive({ type: 'state', latest, now: performance.now() });
    stops = [startAlarms(), onMapCommand((command) => commands.push(command))];
  });
  afterEach(() => {
    for (const stop of stops) stop();
    vi.restoreAllMocks();
  });
  const follow = (): void => {
    const [item] = calling(alarmList.get());
    if (!item) throw new Error('no alarm');
    followAlarm(item);
  };

  test('leads to its tag, its sensor and its moment, and counts as seen', () => {
    tellAlarms({
      ...alarm('a', { tag_id: '5', reason: { sensor: 'co2' } }),
      raised_at: { sec: 9_000, nanosec: 1_200_001 },
    });
    act({ type: 'compare', compare: { by: 'ago', seconds: 60 } });
    follow();
    const { view } = store.get();
    // No earlier than the observation that raised it.
    expect(view).toMatchObject({ moment: 9_000.002, selected: '5', sensor: 'co2', pane: 'map' });
    expect(view).toMatchObject({ period: { kind: 'day' }, chart: null, compare: null });
    expect(commands).toEqual([{ type: 'show', tagId: '5' }]);
    expect(calling(alarmList.get())).toEqual([]);
  });

  test('of the house to its moment alone; without a memory to now', () => {
    act({ type: 'select', tagId: '1' });
    tellAlarms(alarm('a', { tag_id: '', raised: 9_500, reason: { kind: 'silent', sensor: '' } }));
    follow();
    expect(store.get().view).toMatchObject({
      moment: 9_500,
      selected: null,
      sensor: 'temperature',
    });
    expect(commands).toEqual([]);
    receive({ type: 'remembered', remembered: { ...NOT_ASKED, state: 'off' } });
    tellAlarms(alarm('b', { raised: 9_500 }));
    follow();
    expect(store.get().view).toMatchObject({ moment: null, selected: '1' });
  });
});
