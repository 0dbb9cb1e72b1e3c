import { expect, test } from 'vitest';

import { alarm } from '../testing/alarms';
import {
  FORGET_MS,
  isShelfHeld,
  acknowledge,
  nextEnd,
  NO_LOCAL_ALARMS,
  pruned,
  readStored,
  shelfMinutes,
  shelve,
  faultKey,
  writeStored,
  type LocalAlarms,
} from './own';

const AT = 1_800_000_000_000;
const rated = (id: string) => ({ alarm: alarm(id, { tag_id: id }) });

const through = (local: LocalAlarms): LocalAlarms => {
  let text = '';
  writeStored({ setItem: (_, value) => (text = value) }, local);
  return readStored({ getItem: () => text });
};

test('what was acknowledged and shelved comes back after a reload', () => {
  const acknowledged = acknowledge(NO_LOCAL_ALARMS, [rated('a')], AT);
  const local = shelve(acknowledged, [rated('b')], AT + 900_000, 'fan off');
  expect(through(local)).toEqual(local);
});

test.each([null, '', '{', 'null', '7', '{"acknowledged":7,"shelved":{}}'])(
  '%j counts as nothing stored',
  (text) => {
    expect(readStored({ getItem: () => text })).toEqual(NO_LOCAL_ALARMS);
  },
);

test('what was acknowledged long ago is forgotten, unless it is still listed', () => {
  const local = acknowledge(NO_LOCAL_ALARMS, [rated('a'), rated('b')], AT);
  expect(pruned(local, new Set(), AT + FORGET_MS - 1)).toBe(local);
  expect([...pruned(local, new Set(['b']), AT + FORGET_MS).acknowledged.keys()]).toEqual(['b']);
});

test('a shelf ends by itself, at its very moment', () => {
  const local = shelve(NO_LOCAL_ALARMS, [rated('a')], AT + 1_000, '');
  expect(pruned(local, new Set(), AT + 999)).toBe(local);
  expect(pruned(local, new Set(), AT + 1_000).shelved.size).toBe(0);
  expect(nextEnd(local, AT)).toBe(AT + 1_000);
  expect(nextEnd(local, AT + 1_000)).toBe(Infinity);
});

test('a shelf holds until it ends, or the alarm gets worse', () => {
  const shelf = { verdict: 'stressed', until: AT + 1_000, reason: '' } as const;
  expect(isShelfHeld(shelf, 'stressed', AT)).toBe(true);
  expect(isShelfHeld(shelf, 'stressed', AT + 1_000)).toBe(false);
  expect(isShelfHeld(shelf, 'critical', AT)).toBe(false);
  expect(isShelfHeld({ ...shelf, verdict: 'critical' }, 'critical', AT)).toBe(true);
});

test('a clock that is set back makes no shelf longer than any', () => {
  const shelf = { verdict: 'stressed', until: AT + 480 * 60_000, reason: '' } as const;
  expect(isShelfHeld(shelf, 'stressed', AT)).toBe(true);
  expect(isShelfHeld(shelf, 'stressed', AT - 1)).toBe(false);
});

test('a critical alarm is shelved for an hour at most, whatever is stored', () => {
  expect(Math.max(...shelfMinutes('critical'))).toBe(60);
  expect(shelfMinutes('stressed')).toContain(480);
  const shelf = { verdict: 'critical', until: AT + 3_600_000, reason: 'x' } as const;
  expect(isShelfHeld(shelf, 'critical', AT)).toBe(true);
  expect(isShelfHeld(shelf, 'critical', AT - 1)).toBe(false);
  const text = JSON.stringify({ shelved: [['a', { ...shelf, until: AT + 28_800_000 }]] });
  expect(pruned(readStored({ getItem: () => text }), new Set(), AT).shelved.size).toBe(0);
});

test('too cold is not too warm, here is not there, and the next time is the same again', () => {
  const cold = alarm('a', { reason: { value: 6, limit: 10 } });
  expect(faultKey(alarm('b', { raised: 990, reason: { value: 7, limit: 10 } }))).toBe(
    faultKey(cold),
  );
  for (const other of [
    alarm('b', { reason: { value: 40, limit: 35 } }),
    alarm('b', { tag_id: '2', reason: { value: 6, limit: 10 } }),
    alarm('b', { reason: { sensor: 'co2', value: 6, limit: 10 } }),
    alarm('b', { reason: { kind: 'old' } }),
  ]) {
    expect(faultKey(other)).not.toBe(faultKey(cold));
  }
});
