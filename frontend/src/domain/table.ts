/** Rows of the table: columns, sorting, filter. */
import type { TagHealth, Verdict } from '../contract/types';
import { S } from '../strings';
import { ageSeconds, isoText } from './time';
import { type Cell, csv, finder } from './text';
import { type HouseHealth, reasonsText, severity, attemptOutcome } from './health';
import { groupedBy, memoLast, memoOne } from './memo';
import { speciesText } from './marks';
import type { Catalogue, Sensor } from './sensors';
import { toShown } from './format';
import { compareIds, type Tag } from './twin';

export interface Row {
  readonly tag: Tag;
  readonly health: TagHealth;
}

export function rowsOf(tags: readonly Tag[], health: HouseHealth): Row[] {
  return tags.flatMap((tag) => {
    const own = health.byTag.get(tag.id);
    return own ? [{ tag, health: own }] : [];
  });
}

export interface AreaHead {
  /** Empty: tags without an area. */
  readonly area: string;
  readonly count: number;
  readonly worst: Verdict;
}

export type Line = Row | AreaHead;

type Area = ReturnType<typeof inAreas>[number];

/** Rows by area, in the order of each area's first row; rows without an area last. */
export function inAreas(rows: readonly Row[], areaOf: (tagId: string) => string) {
  const areas = groupedBy(rows, ({ tag }) => areaOf(tag.id));
  const found = [...areas].map(([area, own]) => ({ area, rows: own }));
  return found.sort((a, b) => Number(a.area === '') - Number(b.area === ''));
}

export type AreaOnMap = ReturnType<typeof areasOnMap>[number];

export function areasOnMap(tags: readonly Tag[], areaOf: (tagId: string) => string) {
  const pinned = tags.filter(({ id, at }) => at && areaOf(id) !== '');
  return [...groupedBy(pinned, ({ id }) => areaOf(id))].map(([name, own]) => ({
    name,
    places: own.flatMap(({ at }) => at ?? []),
  }));
}

export function withHeads(areas: readonly Area[]): readonly Line[] {
  if (areas[0]?.area === '') return areas[0].rows;
  return areas.flatMap(({ area, rows }): readonly Line[] => {
    const worst = rows.reduce((a, b) => (severity(b.health) > severity(a.health) ? b : a));
    return [{ area, count: rows.length, worst: worst.health.verdict }, ...rows];
  });
}

/** What a column sorts by; null sorts last in both directions. */
function sortKey({ tag, health }: Row, column: string): number | string | null {
  switch (column) {
    case 'health':
      return severity(health);
    case 'tag':
      return tag.id;
    case 'species':
      return tag.species || null;
    case 'flowers':
      return tag.isObserved ? tag.flowerCount : null;
    case 'age':
      // By time and not by age: ages grow, but their order stays.
      return typeof tag.scannedAt === 'number' ? -tag.scannedAt : null;
    default:
      return tag.readings.get(column) ?? null;
  }
}

/** `rows` must be in the order of their ids; equal rows keep it. */
export function sortRows(
  rows: readonly Row[],
  { column, descending }: { readonly column: string; readonly descending: boolean },
): Row[] {
  if (column === 'tag') return descending ? [...rows].reverse() : [...rows];
  const direction = descending ? -1 : 1;
  return rows
    .map((row) => ({ row, key: sortKey(row, column) }))
    .sort(({ key: a }, { key: b }) => {
      // Many rows share few texts, and a collator is slow.
      if (a === b) return 0;
      if (a === null || b === null) return Number(a === null) - Number(b === null);
      return direction * (typeof a === 'number' ? a - Number(b) : compareIds(a, String(b)));
    })
    .map(({ row }) => row);
}

/** Rows of that health, or of any, that contain every word of the text (`finder`). */
export function filterRows(
  rows: readonly Row[],
  text: string,
  health: Verdict | null,
  sensors: Catalogue,
): readonly Row[] {
  const ids = new Set(rows.map(({ tag }) => tag.id));
  const isFound = finder(text, (id) => ids.has(id));
  if (!isFound && health === null) return rows;
  return rows.filter(
    ({ tag, health: own }) =>
      (health === null || own.verdict === health) &&
      (!isFound || isFound(tag.id, haystack(tag)(own, sensors))),
  );
}

/** Cached, as every typed letter searches all tags. */
const haystack = memoOne((tag: Tag) =>
  memoLast((health: TagHealth, sensors: Catalogue) => haystackOf(tag, health, sensors)),
);

function haystackOf(tag: Tag, health: TagHealth, sensors: Catalogue): string {
  return [
    tag.id,
    sensors.areaOf(tag.id),
    tag.species ? `${tag.species} ${speciesText(tag.species)}` : S.unclassified,
    S.health[health.verdict],
    tag.anomaly ? S.pest : '',
    tag.at ? '' : tag.farOff ? S.farOff : S.notOnMap,
    tag.scannedAt === 'never' ? S.neverObserved : '',
    tag.failedAttempt ? S.attemptOutcomes[attemptOutcome(tag.failedAttempt.status)] : '',
    ...[...tag.readings.keys()].map((name) => `${name} ${sensors.named(name).label}`),
  ]
    .join(' ')
    .toLowerCase();
}

/**
 * The table as a file: raw values at full precision, in the units that the page shows. For programs,
 * column names and number formats are the same in every language.
 */
export function tableCsv(
  rows: readonly Row[],
  catalogue: Catalogue,
  sensors: readonly Sensor[],
  /** Ages are as of then, ROS seconds. */
  now: number,
): string {
  const header: Cell[] = [
    ...['tag', 'health', 'reasons'],
    ...sensors.map((sensor) => {
      const suffix = sensor.unit;
      return suffix ? `${sensor.dataLabel} [${suffix}]` : sensor.dataLabel;
    }),
    ...['species', 'species confidence', 'blooms', 'bugs', 'pest', 'age [s]'],
    ...['last observed [UTC]', 'x [m]', 'y [m]'],
  ];
  const lines = rows.map(({ tag, health }): Cell[] => {
    const place = tag.at ?? tag.farOff;
    const age = ageSeconds(tag.scannedAt, now);
    return [
      tag.id,
      // As on the wire, whatever the page's language.
      health.verdict,
      reasonsText(catalogue, health.reasons) || null,
      ...sensors.map((sensor): Cell => {
        const value = tag.readings.get(sensor.name);
        return value == null ? null : round(toShown(sensor, value));
      }),
      tag.species || null,
      tag.speciesConfidence === null ? null : round(tag.speciesConfidence),
      tag.flowerCount,
      tag.bugCount,
      tag.anomaly ? 'yes' : 'no',
      age === null ? null : Math.round(age),
      tag.wire.last_observed === 0 ? null : isoText(tag.wire.last_observed),
      place && round(place.x),
      place && round(place.y),
    ];
  });
  return csv([header, ...lines]);
}

/** Drops the noise of binary fractions (float32 23.4 is 23.399999618530273). */
const round = (value: number): number => Number(value.toPrecision(7));
