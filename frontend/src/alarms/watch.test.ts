import { afterEach, beforeEach, expect, test, vi } from 'vitest';

import { act, receive } from '../store/app';
import { started } from '../testing/life';
import { alarm, alarms, reportAlarms } from '../testing/alarms';
import { showTags } from '../testing/page';
import { wireTag } from '../testing/tags';
import {
  acknowledgeAlarms,
  lastAction,
  FORGET_MS,
  NO_LOCAL_ALARMS,
  own,
  shelveAlarms,
  startOwn,
  unacknowledgeAlarms,
  undo,
  UNDO_MS,
  unshelveAlarms,
} from './own';
import { calling } from './list';
import {
  alarmList,
  dismissMeanwhile,
  meanwhile,
  onNews,
  startAlarms,
  startMeanwhile,
} from './watch';

const STRESSED = { verdict: 'stressed' } as const;
let stops: (() => void)[];
let announced: string[];
const stored = new Map<string, string>();
const storage = {
  getItem: (key: string) => stored.get(key) ?? null,
  setItem: (key: string, text: string) => void stored.set(key, text),
};

const start = (): void => {
  stops = [
    started((on) => startOwn(storage, on)),
    started(startAlarms),
    started(startMeanwhile),
    started((on) =>
      onNews(({ raised, cleared }) => {
        announced.push(...raised.map(({ alarm: { id } }) => id));
        announced.push(...cleared.map(({ alarm: { id } }) => `-${id}`));
      }, on),
    ),
  ];
};
const stop = (): void => {
  for (const each of stops.reverse()) each();
};

beforeEach(() => {
  vi.useFakeTimers({ toFake: ['setTimeout', 'clearTimeout', 'Date'] });
  announced = [];
  stored.clear();
  own.set(NO_LOCAL_ALARMS);
  showTags([wireTag()]);
  start();
});
afterEach(() => {
  stop();
  vi.useRealTimers();
});

const ids = (): string[] => calling(alarmList.get()).map(({ alarm: { id } }) => id);
const item = (id: string): ReturnType<typeof calling>[number] => {
  const { active, shelved } = alarmList.get();
  const found = [...active, ...shelved].find((each) => each.alarm.id === id);
  if (!found) throw new Error(`no alarm ${id}`);
  return found;
};

test('alarms of the first frame are not announced; later ones are, once', () => {
  reportAlarms(alarm('a'));
  expect(announced).toEqual([]);
  expect(ids()).toEqual(['a']);
  reportAlarms(alarm('b', { tag_id: '2' }), alarm('a'));
  reportAlarms(alarm('b', { tag_id: '2' }), alarm('a'));
  expect(announced).toEqual(['b']);
  reportAlarms(alarm('b', { tag_id: '2', cleared: 950 }), alarm('a'));
  expect(announced).toEqual(['b', '-b']);
});

test('a restarted bridge that replays the past announces nothing twice', () => {
  reportAlarms(alarm('a'));
  receive({ alarms: alarms([], { source: 'starting', since: null }) });
  expect(ids()).toEqual([]);
  reportAlarms(alarm('a'), alarm('b', { tag_id: '2' }));
  expect(announced).toEqual(['b']);
});

test('a worse alarm is announced again, acknowledged or not', () => {
  reportAlarms(alarm('a', { reason: STRESSED }));
  acknowledgeAlarms([item('a')]);
  expect(ids()).toEqual([]);
  reportAlarms(alarm('a'));
  expect(ids()).toEqual(['a']);
  expect(announced).toEqual(['a']);
});

test('acknowledgements survive a reload, and own actions are not announced', () => {
  reportAlarms(alarm('a'), alarm('b', { tag_id: '2' }));
  acknowledgeAlarms([item('a')]);
  shelveAlarms([item('b')], 15, 'x');
  expect(ids()).toEqual([]);
  unshelveAlarms([item('b')]);
  expect(ids()).toEqual(['b']);
  stop();
  own.set(NO_LOCAL_ALARMS);
  start();
  reportAlarms(alarm('a'), alarm('b', { tag_id: '2' }));
  expect(ids()).toEqual(['b']);
  expect(announced).toEqual([]);
});

test('acknowledged long ago, a lasting alarm stays so while the list is not there yet', () => {
  reportAlarms(alarm('a'));
  acknowledgeAlarms([item('a')]);
  stop();
  vi.setSystemTime(Date.now() + FORGET_MS);
  own.set(NO_LOCAL_ALARMS);
  receive({ alarms: null });
  start();
  receive({ alarms: alarms([], { source: 'starting', since: null }) });
  reportAlarms(alarm('a'));
  expect(ids()).toEqual([]);
});

test('a shelved alarm returns when its time is over, and is announced', () => {
  reportAlarms(alarm('a'));
  shelveAlarms([item('a')], 15, 'x');
  expect(alarmList.get().shelved).toHaveLength(1);
  vi.advanceTimersByTime(15 * 60_000 - 1);
  expect(ids()).toEqual([]);
  vi.advanceTimersByTime(1);
  expect(ids()).toEqual(['a']);
  expect(announced).toEqual(['a']);
  expect(own.get().shelved.size).toBe(0);
});

test('each action can be undone for a while; another tab’s word ends that', () => {
  const last = (): unknown[] => [lastAction.get()?.what, lastAction.get()?.count];
  reportAlarms(alarm('a'), alarm('b', { tag_id: '2' }));
  acknowledgeAlarms([item('a'), item('b')]);
  expect(last()).toEqual(['acknowledge', 2]);
  undo();
  expect([ids(), lastAction.get()]).toEqual([['a', 'b'], null]);
  acknowledgeAlarms([item('a')]);
  shelveAlarms([item('b')], 15, 'x');
  expect(last()).toEqual(['shelve', 1]);
  undo();
  // Only the last action is undone; earlier ones stand.
  expect(ids()).toEqual(['b']);
  unacknowledgeAlarms([item('a')]);
  expect(ids()).toEqual(['a', 'b']);
  undo();
  expect(ids()).toEqual(['b']);
  shelveAlarms([item('b')], 15, 'x');
  unshelveAlarms([item('b')]);
  undo();
  expect(ids()).toEqual([]);
  unshelveAlarms([item('b')]);
  vi.advanceTimersByTime(UNDO_MS);
  expect(lastAction.get()).toBeNull();
  shelveAlarms([item('b')], 15, 'x');
  window.dispatchEvent(new StorageEvent('storage', { key: 'lupin-twin.alarms' }));
  expect(lastAction.get()).toBeNull();
});

test('what another tab of the browser has acknowledged is so here', () => {
  reportAlarms(alarm('a'));
  stored.set(
    'lupin-twin.alarms',
    JSON.stringify({ acknowledged: [['a', { verdict: 'critical', at: Date.now() }]] }),
  );
  window.dispatchEvent(new StorageEvent('storage', { key: 'lupin-twin.alarms' }));
  expect(ids()).toEqual([]);
});

test('while a past moment is shown, new alarms are listed apart until acknowledged, resolved or dismissed', () => {
  const now = (): string[] => meanwhile.get().map(({ alarm: { id } }) => id);
  reportAlarms(alarm('a'));
  act({ moment: 50 });
  expect(now()).toEqual([]);
  const b = alarm('b', { tag_id: '2', reason: STRESSED });
  const c = alarm('c', { tag_id: '3' });
  reportAlarms(b, alarm('a'));
  reportAlarms(c, b, alarm('a'));
  expect(now()).toEqual(['c', 'b']);
  acknowledgeAlarms([item('b')]);
  expect(now()).toEqual(['c']);
  reportAlarms({ ...c, cleared_at: 990 }, b, alarm('a'));
  expect(now()).toEqual([]);
  reportAlarms(alarm('d', { tag_id: '4' }), alarm('a'));
  expect(now()).toEqual(['d']);
  dismissMeanwhile();
  reportAlarms(alarm('e', { tag_id: '5' }), alarm('d', { tag_id: '4' }), alarm('a'));
  expect(now()).toEqual(['e']);
  act({ moment: null });
  expect(now()).toEqual([]);
  act({ moment: 60 });
  expect(now()).toEqual([]);
});
