/**
 * What one sensor of one tag read over a period: each reading, or buckets where there are too many
 * to show. All times are ROS seconds. Where the robot was away is a gap, and nothing bridges it.
 */
import type { History, Timeline, WireTime } from '../contract/types';
import { type Cell, csv } from './text';
import { hasDate, secondsOf, type Span } from './time';
import { type Catalogue, type TemperatureUnit, toShown, unitOf } from './sensors';
import { type Missing, missingOf } from './timeline';

export interface Reading {
  readonly at: number;
  /** Null: the sensor gave no number. */
  readonly value: number | null;
}

/** All finite readings of `bucketS` seconds from `start` on. */
export interface Bucket {
  readonly start: number;
  readonly n: number;
  readonly mean: number;
  readonly min: number;
  readonly max: number;
}

/** Tries that came to nothing, or looks at the flowers, somewhere in `widthS` seconds from `at` on. */
export interface Mark {
  readonly at: number;
  readonly widthS: number;
  readonly kind: 'failure' | 'look';
  readonly count: number;
}

export interface Series extends Span {
  readonly tagId: string;
  readonly sensor: string;
  /** Width of a bucket, seconds; null: these are readings. */
  readonly bucketS: number | null;
  /** By their time; one of the two lists is empty. */
  readonly readings: readonly Reading[];
  readonly buckets: readonly Bucket[];
  readonly gaps: readonly Span[];
  /** When it was night by the clock; null: that does not tell. */
  readonly nights: readonly Span[] | null;
  readonly missing: readonly Missing[];
}

const spanOf = (span: { readonly from: WireTime; readonly to: WireTime }): Span => ({
  from: secondsOf(span.from),
  to: secondsOf(span.to),
});

/** The series that the bridge told, at `nowS` of the twin's time, ROS seconds. */
export const seriesOf = (wire: History, nowS: number): Series => ({
  ...spanOf(wire),
  tagId: wire.tag_id,
  sensor: wire.sensor_type,
  bucketS: wire.bucket_s,
  readings: wire.readings.map(({ stamp, value }) => ({ at: secondsOf(stamp), value })),
  buckets: wire.buckets.map((bucket) => ({ ...bucket, start: secondsOf(bucket.start) })),
  gaps: wire.gaps.map(spanOf),
  nights: wire.nights?.map(spanOf) ?? null,
  missing: missingOf(wire, nowS),
});

/** The same so many seconds later: to stand beside what was read then. */
export const laterBy = (series: Series, byS: number): Series => ({
  ...series,
  from: series.from + byS,
  to: series.to + byS,
  readings: series.readings.map(({ at, value }) => ({ at: at + byS, value })),
  buckets: series.buckets.map((bucket) => ({ ...bucket, start: bucket.start + byS })),
  gaps: series.gaps.map(({ from, to }) => ({ from: from + byS, to: to + byS })),
  nights: null,
  missing: series.missing.map((each) => ({ ...each, from: each.from + byS, to: each.to + byS })),
});

/** What a tag's timeline tells of tries and looks; scans are told by the readings themselves. */
export const marksOf = ({ buckets, bucket_s: widthS }: Timeline): Mark[] =>
  buckets.flatMap(({ start, failures, looks }) =>
    [
      { kind: 'failure' as const, count: failures },
      { kind: 'look' as const, count: looks },
    ].flatMap(({ kind, count }) =>
      count > 0 ? [{ at: secondsOf(start), widthS, kind, count }] : [],
    ),
  );

/** Where a bucket stands in a picture: its middle, but never later than the series goes. */
export const middleOf = ({ start }: Bucket, { bucketS, to }: Series): number =>
  Math.max(start, Math.min(start + (bucketS ?? 0) / 2, to));

/** What a series has at a moment: the reading that held then, or its bucket; null: a gap. */
export function pointAt(series: Series, at: number): Reading | Bucket | null {
  const { bucketS, gaps, buckets } = series;
  if (bucketS !== null) {
    return buckets.find(({ start }) => at >= start && at < start + bucketS) ?? null;
  }
  if (gaps.some(({ from, to }) => at > from && at < to)) return null;
  return lastUntil(series, at);
}

/** The last reading or bucket that had begun by then: what was known at that moment. */
export function lastUntil({ readings, buckets }: Series, at: number): Reading | Bucket | null {
  return (
    readings.findLast((reading) => reading.at <= at) ??
    buckets.findLast(({ start }) => start <= at) ??
    null
  );
}

/** What is to be told of a series in one sentence. */
export interface SeriesSummary {
  readonly count: number;
  readonly latest: { readonly at: number; readonly value: number } | null;
  readonly min: number | null;
  readonly max: number | null;
  readonly gaps: number;
}

export function summaryOf(series: Series): SeriesSummary {
  const points =
    series.bucketS === null
      ? series.readings.flatMap(({ at, value }) =>
          value === null ? [] : [{ at, value, n: 1, min: value, max: value }],
        )
      : series.buckets.map((bucket) => ({ ...bucket, at: bucket.start, value: bucket.mean }));
  const last = points.at(-1);
  return {
    count: points.reduce((sum, { n }) => sum + n, 0),
    latest: last ? { at: last.at, value: last.value } : null,
    min: points.reduce<number | null>((least, { min }) => Math.min(least ?? min, min), null),
    max: points.reduce<number | null>((most, { max }) => Math.max(most ?? max, max), null),
    gaps: series.gaps.length,
  };
}

/** What a chart shows, as rows: for the keyboard, for screen readers, and to take away. Pure. */

/** Times are ROS seconds, values in the sensor's own unit. */
export type SeriesRow =
  | { readonly kind: 'reading'; readonly at: number; readonly value: number | null }
  | {
      readonly kind: 'bucket';
      readonly at: number;
      readonly to: number;
      readonly n: number;
      readonly mean: number;
      readonly min: number;
      readonly max: number;
    }
  | {
      readonly kind: 'gap' | 'not_kept' | 'not_recorded';
      readonly at: number;
      readonly to: number;
    }
  | {
      readonly kind: 'failure' | 'look';
      readonly at: number;
      readonly to: number;
      readonly count: number;
    };

/** By their time; what begins at one moment: what is missing, gap, values, marks. */
export function rowsOfSeries(series: Series, marks: readonly Mark[]): SeriesRow[] {
  const width = series.bucketS ?? 0;
  const rows: SeriesRow[] = [
    ...series.missing.map(({ from, to, why }) => ({ kind: why, at: from, to })),
    ...series.gaps.map(({ from, to }) => ({ kind: 'gap' as const, at: from, to })),
    ...series.readings.map((reading) => ({ kind: 'reading' as const, ...reading })),
    ...series.buckets.map(({ start, ...bucket }) => ({
      kind: 'bucket' as const,
      at: start,
      to: start + width,
      ...bucket,
    })),
    ...marks
      .filter(({ at, widthS }) => at + widthS >= series.from && at < series.to)
      .map(({ kind, at, widthS, count }) => ({ kind, at, to: at + widthS, count })),
  ];
  // The sort is stable: what is first above stays first.
  return rows.sort((a, b) => a.at - b.at);
}

export interface Charted {
  readonly series: Series;
  readonly marks: readonly Mark[];
}

const HEADER = [
  ...['time_iso', 'stamp', 'until', 'tag_id', 'sensor', 'unit'],
  ...['kind', 'n', 'value', 'min', 'max'],
];

/** The rows of all that is charted. A simulated clock has no dates: `time_iso` is empty then. */
export function chartCsv(
  sensors: Catalogue,
  charted: readonly Charted[],
  unit: TemperatureUnit,
): string {
  const rows = charted.flatMap(({ series, marks }) => {
    const sensor = sensors.named(series.sensor);
    const shown = (value: number | null): Cell =>
      value === null ? null : Number(toShown(sensor, value, unit).toPrecision(12));
    return rowsOfSeries(series, marks).map((row): Cell[] => [
      hasDate(row.at) ? new Date(row.at * 1000).toISOString() : null,
      Number(row.at.toFixed(6)),
      row.kind === 'reading' ? null : Number(row.to.toFixed(6)),
      ...[series.tagId, series.sensor, unitOf(sensor, unit), row.kind],
      ...valuesOf(row, shown),
    ]);
  });
  return csv([HEADER, ...rows]);
}

function valuesOf(row: SeriesRow, shown: (value: number | null) => Cell): Cell[] {
  switch (row.kind) {
    case 'reading':
      return [1, shown(row.value), null, null];
    case 'bucket':
      return [row.n, shown(row.mean), shown(row.min), shown(row.max)];
    case 'gap':
      return [0, null, null, null];
    case 'not_kept':
    case 'not_recorded':
      return [null, null, null, null];
    case 'failure':
    case 'look':
      return [row.count, null, null, null];
  }
}
