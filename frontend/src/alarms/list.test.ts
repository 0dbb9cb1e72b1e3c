import { describe, expect, test } from 'vitest';

import type { Alarm } from '../contract/types';
import { alarm } from '../testing/alarms';
import { reason } from '../testing/health';
import { acknowledge, NO_LOCAL_ALARMS, shelve, type LocalAlarms } from './own';
import {
  calling,
  EMPTY_LIST,
  heldList,
  isAwaited,
  LISTED_S,
  listOf,
  newsOf,
  sharedList,
  type AlarmList,
  type Item,
} from './list';

const AT = 1_800_000_000_000;
const NOW_S = 1_000;
const list = (alarms: readonly Alarm[], local: LocalAlarms = NO_LOCAL_ALARMS): AlarmList =>
  listOf(alarms, local, NOW_S, AT);
const ids = (items: readonly Item[]): string[] => items.map(({ alarm: { id } }) => id);
const stressed = { verdict: 'stressed' } as const;

describe('order', () => {
  test('active: the worst first, of one verdict the farthest beyond its limit', () => {
    const shown = list([
      alarm('mild', { reason: { ...stressed, value: -90, limit: 10 } }),
      alarm('bad', { raised: 500, reason: { value: 9, limit: 10 } }),
      alarm('not known', { raised: 995, reason: { verdict: 'unknown' } }),
      alarm('bad and far', { raised: 100, reason: { value: 5, limit: 10 } }),
    ]);
    expect(ids(shown.active)).toEqual(['bad and far', 'bad', 'mild', 'not known']);
  });

  test('resolved: what was cleared last first; no more than a day', () => {
    const far = LISTED_S + NOW_S;
    const over = [
      alarm('early', { raised: 500, cleared: NOW_S }),
      alarm('late', { raised: 100, cleared: NOW_S + 1 }),
    ];
    expect(ids(list(over).resolved)).toEqual(['late', 'early']);
    expect(ids(listOf(over, NO_LOCAL_ALARMS, far - 1, AT).resolved)).toEqual(['late', 'early']);
    expect(ids(listOf(over, NO_LOCAL_ALARMS, far, AT).resolved)).toEqual(['late']);
    // Without the twin's time, the age of resolved alarms is unknown.
    expect(listOf(over, NO_LOCAL_ALARMS, null, AT).resolved).toHaveLength(2);
  });

  test('of what came at once the order is the same, however it came', () => {
    const two = [alarm('b'), alarm('a')];
    expect(ids(list(two).active)).toEqual(['a', 'b']);
    expect(ids(list(two.toReversed()).active)).toEqual(['a', 'b']);
  });
});

describe('acknowledged and shelved', () => {
  const mild = { alarm: alarm('a', { reason: stressed }) };

  test('an acknowledged alarm does not call until it gets worse', () => {
    const local = acknowledge(NO_LOCAL_ALARMS, [mild], AT);
    expect(calling(list([mild.alarm]))).toHaveLength(1);
    expect(calling(list([mild.alarm], local))).toEqual([]);
    expect(list([mild.alarm], local).active[0]?.isAcknowledged).toBe(true);
    // At equal verdicts, it comes after unacknowledged ones.
    const older = alarm('older', { raised: 1, reason: stressed });
    expect(ids(list([mild.alarm, older], local).active)).toEqual(['older', 'a']);
    const worse = { ...mild.alarm, reason: reason() };
    expect(calling(list([worse], local))).toHaveLength(1);
  });

  test('what is shelved stands apart with its end, comes back then, or when it gets worse', () => {
    const local = shelve(NO_LOCAL_ALARMS, [mild], AT + 1_000, 'fan off');
    const shown = list([mild.alarm], local);
    expect(shown.active).toEqual([]);
    expect(shown.shelved[0]?.shelf).toMatchObject({ until: AT + 1_000, reason: 'fan off' });
    expect(calling(shown)).toEqual([]);
    expect(listOf([mild.alarm], local, NOW_S, AT + 1_000).shelved).toEqual([]);
    const worse = list([{ ...mild.alarm, reason: reason() }], local);
    expect(calling(worse)).toHaveLength(1);
    // The same fault, raised again, is still shelved.
    expect(list([alarm('later', { raised: 990, reason: stressed })], local).active).toEqual([]);
  });
});

describe('news', () => {
  const a = alarm('a', { reason: stressed });
  const b = alarm('b', { tag_id: '2' });
  const newsIds = (before: AlarmList, now: AlarmList): string[][] => {
    const { raised, cleared } = newsOf(before, now);
    return [ids(raised), ids(cleared)];
  };

  test('is what has come, got worse or is resolved; what stays is none', () => {
    expect(newsIds(EMPTY_LIST, list([a]))).toEqual([['a'], []]);
    expect(newsIds(list([a]), list([b, a]))).toEqual([['b'], []]);
    expect(newsIds(list([a]), list([{ ...a, reason: reason() }]))).toEqual([['a'], []]);
    expect(newsIds(list([{ ...a, reason: reason() }]), list([a]))).toEqual([[], []]);
    const over = { ...a, cleared_at: 999 };
    expect(newsIds(list([a, b]), list([over, b]))).toEqual([[], ['a']]);
    expect(newsIds(EMPTY_LIST, list([over]))).toEqual([[], []]);
    expect(newsIds(list([a]), list([]))).toEqual([[], []]);
  });

  test('not what is acknowledged or shelved; what comes back from there is', () => {
    const mild = { alarm: a };
    const local = shelve(NO_LOCAL_ALARMS, [mild], AT + 1_000, 'fan off');
    expect(newsIds(EMPTY_LIST, list([a], local))).toEqual([[], []]);
    expect(newsIds(EMPTY_LIST, list([a], acknowledge(NO_LOCAL_ALARMS, [mild], AT)))).toEqual([
      [],
      [],
    ]);
    expect(newsIds(list([a], local), list([a]))).toEqual([['a'], []]);
  });
});

describe('an order that is held', () => {
  const before = list([alarm('a'), alarm('b', { reason: stressed })]);

  test('none comes, goes or moves; each is as it is now, and what is new is apart', () => {
    const now = list([
      alarm('new', { tag_id: '3', raised: 999 }),
      alarm('a', { cleared: 990 }),
      alarm('b', { tag_id: '2' }),
    ]);
    expect(ids(now.active)).toEqual(['b', 'new']);
    const { shown, added } = heldList(before, now);
    expect(ids(shown.active)).toEqual(['a', 'b']);
    expect(shown.active[0]?.alarm.cleared_at).not.toBeNull();
    expect(shown.active[1]?.alarm.reason.verdict).toBe('critical');
    expect([ids(shown.shelved), ids(shown.resolved)]).toEqual([[], []]);
    expect(ids(added)).toEqual(['new']);
  });

  test('what the bridge takes back stays until the order is let go', () => {
    expect(ids(heldList(before, EMPTY_LIST).shown.active)).toEqual(['a', 'b']);
  });
});

test('a second scan is waited for by what a first one found: beyond a range, no value, or no answer', () => {
  const held = { ...reason(), release: 10.4 };
  const kinds = ['reading_failed', 'range', 'scan_failed', 'pest', 'old'] as const;
  const awaited = [...kinds.map((kind) => reason({ kind })), held].filter(isAwaited);
  expect(awaited.map(({ kind }) => kind)).toEqual(['reading_failed', 'range', 'scan_failed']);
});

test('what is the same stays the same, and the rest is not', () => {
  const before = list([alarm('a'), alarm('b')]);
  expect(sharedList(before, list([alarm('a'), alarm('b')]))).toBe(before);
  const next = sharedList(before, list([alarm('a'), alarm('b', { worst: 3 })]));
  expect(next).not.toBe(before);
  expect(next.active[0]).toBe(before.active[0]);
  expect(next.active[1]).not.toBe(before.active[1]);
  expect(next.resolved).toBe(before.resolved);
});

test('five hundred are put in order, by tag where they are equals, and are kept where they are the same', () => {
  const many = Array.from({ length: 500 }, (_, at) =>
    alarm(`a${at}`, { tag_id: String(500 - at) }),
  );
  const first = list(many);
  expect(first.active.map(({ alarm: { id } }) => id)).toEqual(many.map(({ id }) => id).reverse());
  expect(sharedList(first, list(structuredClone(many)))).toBe(first);
});
