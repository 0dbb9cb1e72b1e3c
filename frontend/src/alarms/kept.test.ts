import { describe, expect, test } from 'vitest';

import { alarm } from '../testing/alarms';
import {
  FORGET_MS,
  isKept,
  isShelfHeld,
  LONGEST_SHELF_MS,
  markSeen,
  MOST_SEEN,
  MOST_SHELVED,
  nextEnd,
  NOTHING_KEPT,
  pruned,
  readKept,
  shelve,
  unshelve,
  whatOf,
  writeKept,
  type Kept,
  type Rated,
} from './kept';

const AT = 1_800_000_000_000;
const rated = (id: string, verdict: Rated['verdict'] = 'stressed'): Rated => ({
  alarm: alarm(id, { tag_id: id }),
  verdict,
});
const many = (count: number): Rated[] => Array.from({ length: count }, (_, at) => rated(`a${at}`));

const through = (kept: Kept): Kept => {
  let text = '';
  writeKept({ setItem: (_, value) => (text = value) }, kept);
  return readKept({ getItem: () => text });
};

test('what was seen, put aside and wished for comes back after a reload', () => {
  const seen = markSeen({ ...NOTHING_KEPT, sound: true }, [rated('a', 'critical')], AT);
  const kept = shelve(seen, rated('b'), AT + 900_000);
  expect(through(kept)).toEqual(kept);
  expect(through(unshelve(kept, rated('b').alarm)).shelved.size).toBe(0);
});

test.each([
  null,
  '',
  '{',
  'null',
  '7',
  '{"seen":7,"shelved":{}}',
  '{"seen":[7,["a"],["a","pink",1],["a","critical",null],[1,"critical",1]],"sound":1}',
])('%j counts as nothing kept', (text) => {
  expect(readKept({ getItem: () => text })).toEqual(NOTHING_KEPT);
});

test('a full storage does no harm', () => {
  const full = {
    setItem: () => {
      throw new Error('quota');
    },
  };
  expect(() => {
    writeKept(full, NOTHING_KEPT);
  }).not.toThrow();
});

describe('bounds', () => {
  test('no more is kept than the limit, and the oldest goes first', () => {
    const listed = new Set<string>();
    const full = markSeen(NOTHING_KEPT, many(MOST_SEEN), AT);
    expect(pruned(full, listed, AT)).toBe(full);
    const over = pruned(markSeen(full, [rated('new')], AT), listed, AT);
    expect(over.seen.size).toBe(MOST_SEEN);
    expect([over.seen.has('a0'), over.seen.has('a1'), over.seen.has('new')]).toEqual([
      false,
      true,
      true,
    ]);
    // Seen once more it is the newest.
    expect(pruned(markSeen(full, [rated('a0'), rated('new')], AT), listed, AT).seen.has('a0')).toBe(
      true,
    );
  });

  test('nor more shelves, nor more than that from a storage', () => {
    const aside = many(MOST_SHELVED + 1).reduce(
      (kept, each) => shelve(kept, each, AT + 1_000),
      NOTHING_KEPT,
    );
    expect(pruned(aside, new Set(), AT).shelved.size).toBe(MOST_SHELVED);
    expect(through(aside).shelved.size).toBe(MOST_SHELVED);
    expect(through(markSeen(NOTHING_KEPT, many(MOST_SEEN + 1), AT)).seen.size).toBe(MOST_SEEN);
  });

  test('what was seen long ago is forgotten, unless it is still listed', () => {
    const kept = markSeen(NOTHING_KEPT, [rated('a'), rated('b')], AT);
    expect(pruned(kept, new Set(), AT + FORGET_MS - 1)).toBe(kept);
    expect([...pruned(kept, new Set(['b']), AT + FORGET_MS).seen.keys()]).toEqual(['b']);
  });

  test('a shelf ends by itself, at its very moment', () => {
    const kept = shelve(NOTHING_KEPT, rated('a'), AT + 1_000);
    expect(pruned(kept, new Set(), AT + 999)).toBe(kept);
    expect(pruned(kept, new Set(), AT + 1_000).shelved.size).toBe(0);
    expect(nextEnd(kept, AT)).toBe(AT + 1_000);
    expect(nextEnd(kept, AT + 1_000)).toBeNull();
  });
});

test('a shelf holds until it ends, or the alarm gets worse', () => {
  const shelf = { verdict: 'stressed', until: AT + 1_000 } as const;
  expect(isShelfHeld(shelf, 'stressed', AT)).toBe(true);
  expect(isShelfHeld(shelf, 'stressed', AT + 1_000)).toBe(false);
  expect(isShelfHeld(shelf, 'critical', AT)).toBe(false);
  expect(isShelfHeld({ ...shelf, verdict: 'critical' }, 'critical', AT)).toBe(true);
});

test('a clock that is set back makes no shelf longer than any', () => {
  const shelf = { verdict: 'stressed', until: AT + LONGEST_SHELF_MS } as const;
  expect(isShelfHeld(shelf, 'stressed', AT)).toBe(true);
  expect(isShelfHeld(shelf, 'stressed', AT - 1)).toBe(false);
});

test('too cold is not too warm, here is not there, and the next time is the same again', () => {
  const cold = alarm('a', { reason: { value: 6, limit: 10 } });
  expect(whatOf(alarm('b', { raised: 990, reason: { value: 7, limit: 10 } }))).toBe(whatOf(cold));
  for (const other of [
    alarm('b', { reason: { value: 40, limit: 35 } }),
    alarm('b', { tag_id: '2', reason: { value: 6, limit: 10 } }),
    alarm('b', { reason: { sensor: 'co2', value: 6, limit: 10 } }),
    alarm('b', { reason: { kind: 'old' } }),
  ]) {
    expect(whatOf(other)).not.toBe(whatOf(cold));
  }
});

test('another tab’s word is known by its key', () => {
  expect(isKept('lupin-twin.alarms')).toBe(true);
  expect(isKept(null)).toBe(true);
  expect(isKept('lupin-twin.settings')).toBe(false);
});
