import { expect, test } from 'vitest';

import type { Alarm } from '../contract/types';
import { alarm } from '../testing/alarms';
import { cataloguesOf } from '../domain/sensors';
import { CATALOGUE, IN_FAHRENHEIT, FILE } from '../testing/sensors';
import { alarmsCsv, arranged, causeWords, filtered, tagsText } from './arrange';
import { acknowledge, NO_LOCAL_ALARMS, shelve, type LocalAlarms } from './own';
import { inOrder, listOf } from './list';
import { partsText, type Now } from './words';

const isTag = (): boolean => false;
const AT = 1_800_000_000_000;

const cold = (tag: number) => alarm(`cold${tag}`, { tag_id: String(tag), raised: 100 + tag });
const hot = (tag: number) =>
  alarm(`hot${tag}`, {
    tag_id: String(tag),
    raised: 50 + tag,
    reason: { value: 40, limit: 35, verdict: 'stressed' },
  });
const many = (one: typeof cold, count: number) =>
  Array.from({ length: count }, (_, index) => one(index + 1));
const active = (...alarms: ReturnType<typeof alarm>[]) =>
  listOf(alarms, NO_LOCAL_ALARMS, null, AT).active;

test('many of one cause stand together, the worst cause first; a few stand by themselves', () => {
  const blocks = arranged(active(...many(hot, 6), ...many(cold, 5)), 'cause', CATALOGUE);
  expect(blocks.map(({ cause, items }) => [cause, items.length])).toEqual([
    ['Temperature too low', 5],
    ['Temperature too high', 6],
  ]);
  // Named as in its rows.
  const dry = alarm('dry', { reason: { sensor: 'vpd', value: 1.7, limit: 1.3 } });
  expect(causeWords(dry, CATALOGUE)).toBe('VPD too high');
  const loose = arranged(active(...many(hot, 4), ...many(cold, 4)), 'cause', CATALOGUE);
  expect(loose.map(({ cause, items }) => [cause, items.length])).toEqual([[null, 8]]);
});

test('many of one cause stand where the worst of them does', () => {
  const mild = { verdict: 'stressed' } as const;
  const colds = many(cold, 6).map((each, at) => ({
    ...each,
    reason: at === 0 ? each.reason : { ...each.reason, ...mild },
  }));
  const items = active(...colds, alarm('dry', { raised: 1, reason: { sensor: 'humidity' } }));
  expect(items.map(({ alarm: { id } }) => id).slice(0, 2)).toEqual(['cold1', 'dry']);
  const blocks = arranged(items, 'cause', CATALOGUE);
  expect(blocks.map(({ items: own }) => own.length)).toEqual([6, 1]);
});

test('a few of several causes: the worst first, whatever the cause', () => {
  const worst = alarm('worst', { reason: { sensor: 'humidity', verdict: 'critical' } });
  const mild = { verdict: 'stressed' } as const;
  const items = active(cold(1), alarm('mild', { tag_id: '9', reason: mild }), worst, hot(1));
  const [block] = arranged(items, 'cause', CATALOGUE);
  expect(block?.items.map(({ alarm: { id } }) => id)).toEqual(items.map((it) => it.alarm.id));
  expect(items.map((it) => it.alarm.reason.verdict)).toEqual([
    ...['critical', 'critical', 'stressed', 'stressed'],
  ]);
});

const NBSP = '\u00a0';
const damp = (tag_id: string) => [
  alarm(`rh${tag_id}`, { tag_id, raised: 80, reason: { ...DAMP, value: 93, limit: 85 } }),
  alarm(`vpd${tag_id}`, { tag_id, reason: { ...DAMP, sensor: 'vpd', value: 0.15, limit: 0.2 } }),
];
const DAMP = { sensor: 'humidity', verdict: 'stressed' } as const;

test('a tag whose air is damp by several sensors has one cause; one sensor keeps its name', () => {
  const named = (...alarms: Alarm[]) =>
    arranged(active(...alarms), 'cause', CATALOGUE).map(({ cause, items }) => [
      cause,
      items.length,
    ]);
  expect(named(...damp('4'), cold(1))).toEqual([
    [null, 1],
    ['Air too damp', 2],
  ]);
  expect(named(...damp('4'), ...damp('5').slice(1))).toEqual([['Air too damp', 3]]);
  const only = ['1', '2', '3', '4', '5'].flatMap((tag) => damp(tag).slice(0, 1));
  expect(named(...only)).toEqual([['Humidity too high', 5]]);
  // Dry by one sensor and damp by another is no spell of either.
  const dry = alarm('dry', {
    tag_id: '4',
    reason: { ...DAMP, sensor: 'vpd', value: 1.5, limit: 1.3 },
  });
  expect(named(...damp('4').slice(0, 1), dry)).toEqual([[null, 2]]);
  const list = listOf(damp('4'), NO_LOCAL_ALARMS, null, AT);
  expect(filtered(list, 'too damp', CATALOGUE, isTag).active).toHaveLength(2);
  const now = ({ id }: Alarm): Now => ({
    ...{ kind: 'known', reason: null, trend: null },
    ...(id === 'rh4' ? { value: 96, verdict: 'critical' } : { value: null, verdict: 'healthy' }),
  });
  expect(partsText(list.active, CATALOGUE, now)).toBe(
    `VPD (in range), Humidity 96.0${NBSP}% (critical)`,
  );
});

test('of one cause, each area stands by itself, and is found by its name', () => {
  const areas = { North: ['1', '2', '3', '4', '5'], South: ['6', '7', '8', '9', '1*'] };
  const sensors = cataloguesOf({ ...FILE, areas }).day;
  const items = active(...many(cold, 11));
  const found = arranged(items, 'cause', sensors);
  expect(found.map(({ cause, items: own }) => [cause, own.length]).sort()).toEqual([
    ['North · Temperature too low', 5],
    ['South · Temperature too low', 6],
  ]);
  const list = listOf(many(cold, 11), NO_LOCAL_ALARMS, null, AT);
  expect(filtered(list, 'south', sensors, isTag).active).toHaveLength(6);
});

test('the newest first, or by tag: in one row', () => {
  const items = active(cold(10), hot(2), cold(3));
  const tags = (order: 'newest' | 'tag') =>
    arranged(items, order, CATALOGUE).map((block) => block.items.map(({ alarm: it }) => it.tag_id));
  expect(tags('newest')).toEqual([['10', '3', '2']]);
  expect(tags('tag')).toEqual([['2', '3', '10']]);
});

test('the worst cause first, then unacknowledged ones, then the farthest beyond its limit', () => {
  const worst = alarm('worst', { reason: { sensor: 'light', verdict: 'critical' } });
  const dry = (tag: number) =>
    alarm(`dry${tag}`, {
      tag_id: String(tag),
      reason: { sensor: 'humidity', verdict: 'stressed' },
    });
  const further = { value: 99, limit: 35, verdict: 'stressed' } as const;
  const hots = many(hot, 5).map((each) => ({ ...each, reason: { ...each.reason, ...further } }));
  const all = [...hots, ...many(dry, 7), worst];
  const order = (local: LocalAlarms, alarms = all) => {
    const items = inOrder(listOf(alarms, local, null, AT).active, (item) => item.alarm.reason);
    return arranged(items, 'cause', CATALOGUE).map(
      ({ items: own }) => `${own[0]?.alarm.id.replace(/\d/, '')} ${own.length}`,
    );
  };
  expect(order(NO_LOCAL_ALARMS)).toEqual(['worst 1', 'hot 5', 'dry 7']);
  const seen = hots.map((each) => ({ alarm: each }));
  expect(order(acknowledge(NO_LOCAL_ALARMS, seen, AT))).toEqual(['worst 1', 'dry 7', 'hot 5']);
  // Too few for a block: the worst alarm is first.
  expect(order(NO_LOCAL_ALARMS, [...many(dry, 2), ...hots.slice(0, 1)])).toEqual(['hot 3']);
});

test('a word that is exactly the id of a tag finds that tag, and no other', () => {
  const list = listOf([cold(7), cold(27), hot(71)], NO_LOCAL_ALARMS, null, AT);
  const find = (text: string, ids: readonly string[]) =>
    filtered(list, text, CATALOGUE, (id) => ids.includes(id)).active.map((it) => it.alarm.id);
  expect(find('Tag 7', ['7', '27', '71'])).toEqual(['cold7']);
  expect(find('Tag 7', ['27', '71'])).toEqual(['cold7', 'cold27', 'hot71']);
});

test.each([
  ['tag 3 low', ['cold3']],
  ['HIGH', ['hot2']],
  ['critical', ['cold3']],
  ['  ', ['cold3', 'hot2']],
  ['humidity', []],
])('%j finds %j', (text, ids) => {
  const list = listOf([cold(3), hot(2)], NO_LOCAL_ALARMS, null, AT);
  expect(filtered(list, text, CATALOGUE, isTag).active.map(({ alarm: it }) => it.id)).toEqual(ids);
});

test('as a file: each state, values in the unit of the page, and no formula', () => {
  const evil = alarm('a', { tag_id: '=1+1', raised: 0, worst: 4.2 });
  const local = shelve(NO_LOCAL_ALARMS, [{ alarm: evil }], AT + 60_000, 'fan, off');
  const list = listOf([evil, alarm('b', { cleared: 960 })], local, 1_000, AT);
  const [head, shelved, resolved] = alarmsCsv(list, IN_FAHRENHEIT, () => null)
    .slice(1)
    .split('\r\n');
  expect(head?.split(',')).toHaveLength(16);
  expect(shelved).toBe(
    "shelved,,critical,'=1+1,range,temperature,°F,50,,39.56,43.88,1970-01-01T00:00:00.000Z,,no," +
      `${new Date(AT + 60_000).toISOString()},"fan, off"`,
  );
  expect(resolved).toMatch(/^resolved,,critical,1,.*1970-01-01T00:16:00.000Z,no,,$/);
});

test('the last tag left has its name too', () => {
  const ids = Array.from({ length: 10 }, (_, at) => String(at));
  expect(tagsText(ids.slice(0, 9))).toBe('Tags 0, 1, 2, 3, 4, 5, 6, 7, 8');
  expect(tagsText(ids)).toBe('Tags 0, 1, 2, 3, 4, 5, 6, 7 and 2 more');
});
