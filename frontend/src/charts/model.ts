/** The content of one chart: one sensor of one or several tags. Pure. */
import uPlot from 'uplot';

import { fetchSeries, fetchTimeline } from '../contract/past';
import { type Catalogue, type Catalogues, type Ranges, rangesFor } from '../domain/sensors';
import { toShown } from '../domain/format';
import type { Shared } from '../domain/memo';
import { rangeOf } from '../domain/ramp';
import { laterBy, marksOf, middleOf, type Point, type Series, seriesOf } from '../domain/series';
import { shown } from '../domain/text';
import type { Span } from '../domain/time';
import { S } from '../strings';

export type Line = PlotModel['lines'][number];

interface Band extends Span {
  readonly ranges: Ranges;
}

/**
 * The successive ranges of day and night. `now`, the ranges in force at the moment `at`, hold around it,
 * and where the clock does not decide.
 */
export function bandsOf(
  { from, to }: Span,
  nights: readonly Span[] | null,
  { now, day, night }: Readonly<Record<'now' | 'day' | 'night', Ranges>>,
  at: number | null,
): readonly Band[] {
  if (nights === null) return [{ from, to, ranges: now }];
  const bands: Band[] = [];
  let next = from;
  const add = (until: number, ranges: Ranges): void => {
    const end = Math.min(until, to);
    if (end <= next) return;
    // Light may disagree with the clock, and the chart must match the verdict beside it.
    const isJudged = at !== null && next < at && at <= end;
    bands.push({ from: next, to: end, ranges: isJudged ? now : ranges });
    next = end;
  };
  for (const each of nights) {
    add(each.from, day);
    add(each.to, night);
  }
  add(to, day);
  return bands;
}

export type PlotModel = Shared<ReturnType<typeof modelOf>>;

/** A point of a line, in the shown unit; null breaks the line. */
type Drawn = Pick<Point, 'at' | 'value'>;

/** The points of a series in order, with a break in each gap. */
export function pointsOf(series: Series, shown = (value: number): number => value): Drawn[] {
  const points: Drawn[] = [
    ...series.points.map((point) => ({
      at: middleOf(point, series),
      value: point.value === null ? null : shown(point.value),
    })),
    ...series.gaps.map(({ from, to }) => ({ at: (from + to) / 2, value: null })),
  ];
  return points.sort((a, b) => a.at - b.at);
}

/** What is drawn, from the bottom: the days before, then the lines. */
export const drawnOf = ({
  lines,
}: Pick<PlotModel, 'lines'>): { series: Series; look: number; isBefore: boolean }[] => [
  ...lines.flatMap(({ before, look }) =>
    before ? [{ series: before, look, isBefore: true }] : [],
  ),
  ...lines.map(({ series, look }) => ({ series, look, isBefore: false })),
];

export const hasMarks = ({ lines }: PlotModel): boolean =>
  lines.some(({ marks }) => marks.length > 0);

/** Common times, and the values of each `drawnOf`: null is a break, undefined belongs to another line. */
export const aligned = ({ lines, sensor }: PlotModel): uPlot.AlignedData =>
  uPlot.join(
    drawnOf({ lines }).map(({ series }) => {
      const points = pointsOf(series, (value) => toShown(sensor, value));
      return [points.map(({ at }) => at), points.map(({ value }) => value)];
    }),
  );

/** Room above and below the values, as a share of their spread. */
const ROOM = 0.08;
/** The picture includes the ideal range if the values keep this share of the height. */
const LEAST_SHARE = 0.4;
/** Least height, as a share of the ideal range: less would magnify noise. */
const LEAST_OF_IDEAL = 0.1;
/** Least height, as a share of the values, if the ideal range reaches far beyond them. */
const LEAST_OF_VALUE = 0.1;

/** The values' axis, in the shown unit. */
export function valueRange({ lines, sensor, bands }: PlotModel): [low: number, high: number] {
  const values = drawnOf({ lines }).flatMap(({ series }) =>
    series.points.flatMap(({ min, max }) => [min, max]),
  );
  const all = bands.map(({ ranges }) => ranges);
  const bounds = all.flatMap((ranges) => ranges.ideal ?? []);
  const ideal = bounds.length > 0 ? ([Math.min(...bounds), Math.max(...bounds)] as const) : null;
  const [least0, most0] = ideal ?? [0, 1];
  let { low, high } = rangeOf(values) ?? { low: least0, high: most0 };
  const share = LEAST_OF_VALUE * Math.abs(high);
  const least = Math.min(share || 1, ideal ? LEAST_OF_IDEAL * (ideal[1] - ideal[0]) : Infinity);
  if (high - low < least) {
    const middle = (low + high) / 2;
    // Values that are never negative get no negative half.
    low = Math.max(middle - least / 2, Math.min(low, 0));
    high = low + least;
  }
  if (ideal) {
    const spread = high - low;
    // Each end on its own: if one is too far off, the other can still be included.
    // Beyond the ideal range, the distance to the critical limit matters.
    const critical = all.flatMap((ranges) => ranges.critical ?? []);
    const near = critical.filter((bound) => (bound < ideal[0] ? low < ideal[0] : high > ideal[1]));
    for (const bound of [...near, ...ideal]) {
      const [down, up] = [Math.min(low, bound), Math.max(high, bound)];
      if (spread >= LEAST_SHARE * (up - down)) [low, high] = [down, up];
    }
  }
  const room = (high - low) * ROOM;
  return [toShown(sensor, low - room), toShown(sensor, high + room)];
}

/**
 * The limits named at the picture's edge, with the places of their lines, as at the end of the span:
 * those of the ideal range (the nearer one if it is out of sight), and critical ones in sight.
 */
export function limitsOf(model: PlotModel) {
  const { ideal, critical } = model.bands.at(-1)?.ranges ?? {};
  const [low, high] = valueRange(model);
  const named = (kind: 'ideal' | 'critical') => (value: number) => {
    const at = toShown(model.sensor, value);
    const side =
      at < low ? ('below' as const) : at > high ? ('above' as const) : ('inside' as const);
    return { kind, value, side };
  };
  const [first, last] = (ideal ?? []).map(named('ideal'));
  const edges = [
    ...(first && last?.side !== 'below' ? [first] : []),
    ...(last && first?.side !== 'above' ? [last] : []),
  ];
  const near = ideal ? (critical ?? []).map(named('critical')) : [];
  return [...edges, ...near.filter(({ side }) => side === 'inside')];
}

interface LinesQuery {
  readonly sensors: readonly string[];
  readonly tagIds: readonly string[];
  readonly span: Span;
  /** The twin's time, ROS seconds: the span may end later. */
  readonly nowS: number;
  /** Most readings or buckets per line. */
  readonly points: number;
  /** Length of a day, seconds, if the day before is wanted; else null. */
  readonly dayS: number | null;
}

/** Buckets of marks: exact to a few pixels. */
const MARK_POINTS = 200;

/** A line for each sensor of each tag. */
export async function fetchLines(
  { sensors, tagIds, span, nowS, points, dayS }: LinesQuery,
  signal: AbortSignal,
) {
  const pairs = sensors.flatMap((sensor) => tagIds.map((tagId) => ({ sensor, tagId })));
  const before = dayS === null ? null : dayBefore(span, dayS);
  const fetched = ({ from, to }: Span): Promise<Series[]> =>
    Promise.all(
      pairs.map(async (pair) =>
        seriesOf(await fetchSeries({ ...pair, from, to }, points, signal), nowS),
      ),
    );
  const [series, earlier, timelines] = await Promise.all([
    fetched(span),
    before && fetched(before),
    Promise.all(tagIds.map((tagId) => fetchTimeline(span, MARK_POINTS, signal, tagId))),
  ]);
  const marks = timelines.map(marksOf);
  return series.map((each, index) => {
    const then = earlier?.[index];
    return {
      series: each,
      /** The day before, shifted by a day; null: not shown. */
      before: then ? laterBy(then, dayS ?? 0) : null,
      marks: marks[index % tagIds.length] ?? [],
    };
  });
}

export type Lines = Awaited<ReturnType<typeof fetchLines>>;

/** Null: before the twin's time began, as in a simulation. */
function dayBefore({ from, to }: Span, dayS: number): Span | null {
  return to > dayS ? { from: Math.max(0, from - dayS), to: to - dayS } : null;
}

export const tagLabel = (tagId: string): string => S.card(shown(tagId, 24));

/**
 * The received lines of one sensor. A tag keeps its style, whether others arrive later or have no data.
 * `species` are those of the tags: the ideal range is drawn if all share it.
 */
export function modelOf(
  catalogue: Catalogue,
  { day, night }: Catalogues,
  sensor: string,
  tagIds: readonly string[],
  species: readonly string[],
  all: Lines,
  span: Span,
  moment: number | null,
  nowS: number | null,
) {
  const lines = tagIds.flatMap((tagId, look) =>
    all
      .filter(({ series }) => series.sensor === sensor && series.tagId === tagId)
      .map(({ marks, ...line }) => ({
        ...line,
        /** Index for `lookOf`. */
        look,
        label: tagLabel(tagId),
        /** Those of its period: a bucket belongs to where its middle is. */
        marks: marks.filter(({ at, widthS }) => {
          const middle = at + widthS / 2;
          return middle >= span.from && middle <= span.to;
        }),
      })),
  );
  const now = catalogue.named(sensor);
  const isMixed = new Set(tagIds.map((_, index) => rangesFor(now, species[index] ?? ''))).size > 1;
  const own = (of: Catalogue): Ranges => rangesFor(of.named(sensor), species[0] ?? '');
  const ranges = { now: own(catalogue), day: own(day), night: own(night) };
  // Nights are the same for every line.
  const bands = isMixed
    ? []
    : bandsOf(span, lines[0]?.series.nights ?? null, ranges, moment ?? nowS);
  return {
    sensor: now,
    span,
    /** The page's moment, ROS seconds; null: now. */
    moment,
    lines,
    /** Sorted by time, covering the span. */
    bands,
    /** The lines' plants have different ranges, so no band holds for all. */
    isMixed,
  };
}
