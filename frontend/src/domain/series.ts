/**
 * One sensor of one tag over a period: each reading, or buckets if there are too many to show. All
 * times are ROS seconds. While the robot was away there is a gap, and nothing bridges it.
 */
import type { History, Timeline } from '../contract/types';
import { type Cell, csv } from './text';
import type { Shared } from './memo';
import { hasDate, isoText, type Span } from './time';
import type { Catalogue } from './sensors';
import { toShown } from './format';
import { type Missing, missingOf } from './timeline';

/** A reading, or all finite readings of a bucket. */
export interface Point {
  /** Time of the reading, or the bucket's beginning. */
  readonly at: number;
  /** The mean of a bucket; null: the sensor gave no number. */
  readonly value: number | null;
  readonly min: number | null;
  readonly max: number | null;
  /** The number of readings in it. */
  readonly n: number;
}

/** Failed attempts, or flower inspections, within `widthS` seconds from `at` on. */
export type Mark = Shared<ReturnType<typeof marksOf>[number]>;
export type Series = Shared<ReturnType<typeof seriesOf>>;

export const readingAt = (at: number, value: number | null): Point => ({
  ...{ at, value, min: value, max: value },
  n: Number(value !== null),
});

/** The received series; `nowS` is the twin's time, ROS seconds. */
export const seriesOf = (wire: History, nowS: number) => ({
  ...{ from: wire.from, to: wire.to },
  tagId: wire.tag_id,
  sensor: wire.sensor_type,
  /** Width of a bucket, seconds; null: these are readings. */
  bucketS: wire.bucket_s,
  /** By their time. */
  points: [
    ...wire.readings.map(({ stamp, value }) => readingAt(stamp, value)),
    ...wire.buckets.map(({ start, mean, ...rest }) => ({ ...rest, at: start, value: mean })),
  ] as readonly Point[],
  gaps: wire.gaps,
  /** When it was night by the clock; null: the clock does not decide. */
  nights: wire.nights,
  missing: missingOf(wire, nowS),
});

/** The same series, shifted later, to compare with the readings then. */
export const laterBy = (series: Series, byS: number): Series => ({
  ...series,
  from: series.from + byS,
  to: series.to + byS,
  points: series.points.map((point) => ({ ...point, at: point.at + byS })),
  gaps: series.gaps.map(({ from, to }) => ({ from: from + byS, to: to + byS })),
  nights: null,
  missing: series.missing.map((each) => ({ ...each, from: each.from + byS, to: each.to + byS })),
});

/** The failed attempts and flower inspections of a tag's timeline; readings show the scans. */
export const marksOf = ({ buckets, bucket_s: widthS }: Timeline) =>
  buckets.flatMap(({ start, failures, looks }) =>
    [
      { kind: 'failure' as const, count: failures },
      { kind: 'inspection' as const, count: looks },
    ].flatMap(({ kind, count }) => (count > 0 ? [{ at: start, widthS, kind, count }] : [])),
  );

/** Where a point is drawn: a bucket at its middle, but never after the series' end, or in a gap. */
export function middleOf({ at }: Point, { bucketS, gaps, to }: Series): number {
  if (bucketS === null) return at;
  const middle = Math.max(at, Math.min(at + bucketS / 2, to));
  const gap = gaps.find((span) => middle > span.from && middle < span.to);
  if (!gap) return middle;
  return gap.from >= at ? gap.from : gap.to;
}

/** The series at a moment: the reading valid then, or its bucket; null: a gap. */
export function pointAt(series: Series, moment: number): Point | null {
  const { bucketS, gaps, points } = series;
  if (bucketS !== null) {
    return points.find(({ at }) => moment >= at && moment < at + bucketS) ?? null;
  }
  if (gaps.some(({ from, to }) => moment > from && moment < to)) return null;
  return lastUntil(series, moment);
}

export const lastUntil = ({ points }: Series, moment: number): Point | null =>
  points.findLast(({ at }) => at <= moment) ?? null;

/** Times are ROS seconds, values in the sensor's own unit. */
export interface SeriesRow extends Omit<Point, 'n'> {
  readonly kind: 'reading' | 'bucket' | 'gap' | Missing['why'] | Mark['kind'];
  /** When it ended; a reading has no end. */
  readonly to: number | null;
  /** How often; null: not known. */
  readonly n: number | null;
}

/** Sorted by time; at equal times: missing data, gap, values, marks. */
export function rowsOfSeries(series: Series, marks: readonly Mark[]): SeriesRow[] {
  const { bucketS } = series;
  const event = (kind: SeriesRow['kind'], { from, to }: Span, n: number | null): SeriesRow => ({
    ...{ kind, at: from, to, n },
    ...{ value: null, min: null, max: null },
  });
  const rows: SeriesRow[] = [
    ...series.missing.map((span) => event(span.why, span, null)),
    ...series.gaps.map((span) => event('gap', span, 0)),
    ...series.points.map((point): SeriesRow =>
      bucketS === null
        ? { ...point, kind: 'reading', to: null, n: 1, min: null, max: null }
        : { ...point, kind: 'bucket', to: point.at + bucketS },
    ),
    ...marks
      .filter(({ at, widthS }) => at + widthS >= series.from && at < series.to)
      .map(({ kind, at, widthS, count }) => event(kind, { from: at, to: at + widthS }, count)),
  ];
  // The sort is stable and keeps the order above.
  return rows.sort((a, b) => a.at - b.at);
}

const HEADER = [
  ...['time_iso', 'stamp', 'until', 'tag_id', 'sensor', 'unit'],
  ...['kind', 'n', 'value', 'min', 'max'],
];

/** The rows of all charted series. A simulated clock has no dates, so `time_iso` is then empty. */
export function chartCsv(
  sensors: Catalogue,
  charted: readonly { readonly series: Series; readonly marks: readonly Mark[] }[],
): string {
  const rows = charted.flatMap(({ series, marks }) => {
    const sensor = sensors.named(series.sensor);
    const shown = (value: number | null): Cell =>
      value === null ? null : Number(toShown(sensor, value).toPrecision(12));
    return rowsOfSeries(series, marks).map(({ kind, at, to, n, value, min, max }): Cell[] => [
      hasDate(at) ? isoText(at) : null,
      Number(at.toFixed(6)),
      to && Number(to.toFixed(6)),
      ...[series.tagId, series.sensor, sensor.unit, kind, n],
      ...[shown(value), shown(min), shown(max)],
    ]);
  });
  return csv([HEADER, ...rows]);
}
