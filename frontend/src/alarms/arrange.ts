/** Views of the alarm list: filtered, sorted, grouped by cause and area, or as CSV. Pure. */
import type { Alarm } from '../contract/types';
import { type Cell, csv, finder, shown } from '../domain/text';
import { airOf, isOfRange, nameOf, sideOf } from '../domain/health';
import { groupedBy } from '../domain/memo';
import type { Catalogue } from '../domain/sensors';
import { isoText } from '../domain/time';
import { compareIds } from '../domain/twin';
import { toShown } from '../domain/format';
import { S } from '../strings';
import { causeOf, inEach, MOST_LOOSE, type AlarmList, type Item, type Wrong } from './list';
import { nameText, whatText, worstOf, type Now } from './words';

export const ORDERS = ['cause', 'newest', 'tag'] as const;
/** "cause" puts the worst first. */
export type Order = (typeof ORDERS)[number];

/** Most tags named per cause. */
const MOST_NAMED = 8;

/** Consecutive alarms; with a cause, those that share it: more than `MOST_LOOSE`, or several of one tag. */
export interface Block<T extends Wrong = Item> {
  readonly key: string;
  readonly cause: string | null;
  readonly items: readonly T[];
}

/** The alarms whose words contain all words of `text` (`finder`). */
export function filtered(
  list: AlarmList,
  text: string,
  sensors: Catalogue,
  isTag: (id: string) => boolean,
): AlarmList {
  const isFound = finder(text, isTag);
  if (!isFound) return list;
  const has = ({ alarm }: Item): boolean => {
    const air = airOf(alarm.reason);
    const names = [nameText(alarm, sensors), sharedText([{ alarm }], sensors)];
    const words = [...names, air ? S.airCause[air] : '', S.health[alarm.reason.verdict]];
    return isFound(alarm.tag_id, words.join(' ').toLowerCase());
  };
  return inEach(list, (items) => items.filter(has));
}

/** Blocks in the given order. `items` come worst first, or last resolved first. */
export function arranged(
  items: readonly Item[],
  order: Order,
  sensors: Catalogue,
): readonly Block[] {
  if (order !== 'cause') {
    const by =
      order === 'newest'
        ? (a: Item, b: Item) => b.alarm.raised_at - a.alarm.raised_at
        : (a: Item, b: Item) => compareIds(a.alarm.tag_id, b.alarm.tag_id);
    return [{ key: order, cause: null, items: [...items].sort(by) }];
  }
  return blocksOf(items, sensors);
}

/** Groups items that share a cause into one block, at the place of the worst one. */
export function blocksOf<T extends Wrong>(
  items: readonly T[],
  sensors: Catalogue,
): readonly Block<T>[] {
  const causes = groupedBy(items, ({ alarm }) => causeOf(alarm, sensors));
  const blocks: (Block<T> & { readonly items: T[] })[] = [];
  for (const item of items) {
    const key = causeOf(item.alarm, sensors);
    const own = causes.get(key) ?? [item];
    const before = blocks.at(-1);
    if (own.length > MOST_LOOSE || own.length > tagsOf(own).length) {
      if (own[0] === item) blocks.push({ key, cause: sharedText(own, sensors), items: [...own] });
    } else if (before?.cause === null) before.items.push(item);
    else blocks.push({ key: `from ${item.alarm.id}`, cause: null, items: [item] });
  }
  return blocks;
}

/** The tags of alarms, each once. */
export const tagsOf = (items: readonly Wrong[]): readonly string[] => [
  ...new Set(items.map(({ alarm }) => alarm.tag_id)),
];

/** The cause of alarms that share it, with its area; damp or dry air, if several sensors tell of it. */
function sharedText(items: readonly [Wrong, ...Wrong[]], sensors: Catalogue): string {
  const [{ alarm }] = items;
  const area = sensors.areaOf(alarm.tag_id);
  const air = airOf(alarm.reason);
  const isOne = new Set(items.map((item) => item.alarm.reason.sensor)).size === 1;
  const cause = air && !isOne ? S.airCause[air] : causeWords(alarm, sensors);
  return [...(area === '' ? [] : [shown(area, 32)]), cause].join(' · ');
}

export function causeWords(alarm: Pick<Alarm, 'reason'>, sensors: Catalogue): string {
  const { reason } = alarm;
  if (!isOfRange(reason)) return whatText(alarm, sensors);
  const beyond = sideOf(reason) === 'below' ? S.tooLow(null) : S.tooHigh(null);
  return `${nameOf(sensors.named(reason.sensor))} ${beyond}`;
}

/** Lists tags by name, up to `MOST_NAMED`; instead of "1 more", it names that tag too. */
export function tagsText(ids: readonly string[]): string {
  const count = ids.length <= MOST_NAMED + 1 ? ids.length : MOST_NAMED;
  const named = ids.slice(0, count).map((id) => shown(id, 16));
  return S.alarmTags(named, ids.length - count);
}

/** CSV for programs: the same column names in every language, values in the page's units. */
export function alarmsCsv(
  list: AlarmList,
  sensors: Catalogue,
  nowOf: (alarm: Alarm) => Now | null,
): string {
  const header = [
    ...['state', 'severity now', 'severity at worst', 'tag', 'cause', 'sensor', 'unit', 'limit'],
    ...['now', 'worst', 'first', 'raised [UTC]', 'cleared [UTC]'],
    ...['acknowledged', 'shelved until [UTC]', 'shelved because'],
  ];
  const lines = (['active', 'shelved', 'resolved'] as const).flatMap((state) =>
    list[state].map(({ alarm, isAcknowledged, shelf }): Cell[] => {
      const { reason } = alarm;
      const sensor = sensors.named(reason.sensor);
      const current = nowOf(alarm);
      const value = (given: number | null): Cell =>
        given === null || !Number.isFinite(given)
          ? null
          : Number((reason.sensor === '' ? given : toShown(sensor, given)).toPrecision(7));
      return [
        ...[state, current?.kind === 'known' ? current.verdict : null, reason.verdict],
        ...[alarm.tag_id || null, reason.kind, reason.sensor || null],
        ...[reason.sensor === '' ? null : sensor.unit, value(reason.limit)],
        value(current?.kind === 'known' ? current.value : null),
        ...[value(worstOf(alarm, current)), value(reason.value)],
        ...[isoText(alarm.raised_at), alarm.cleared_at && isoText(alarm.cleared_at)],
        isAcknowledged ? 'yes' : 'no',
        ...[shelf && new Date(shelf.until).toISOString(), shelf?.reason || null],
      ];
    }),
  );
  return csv([header, ...lines]);
}
