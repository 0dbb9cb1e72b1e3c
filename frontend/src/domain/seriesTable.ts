/** What a chart shows, as rows: for the keyboard, for screen readers, and to take away. Pure. */
import type { Cell } from './csv';
import { csv } from './csv';
import { hasDate } from './rostime';
import type { Catalogue } from './sensors';
import type { Mark, Series } from './series';
import { toShown, unitOf, type TemperatureUnit } from './units';

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
