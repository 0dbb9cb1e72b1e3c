/** What the server says of one sensor of several greenhouses, and the lines of its chart. Pure. */
import type { Line } from '../charts/model';
import { secondsOf } from '../domain/rostime';
import type { Span } from '../domain/period';
import type { Time } from './sites';

type Values = readonly (number | null)[];

export interface ComparedSite {
  readonly site: string;
  readonly name: string;
  readonly mean: number | null;
  /** How far it is from the median of all, in the sensor's unit; null: it has no reading. */
  readonly deviation: number | null;
  /** Of each bucket. */
  readonly means: Values;
}

/** `/api/compare`: the outlier first. */
export interface Compared {
  readonly sensor_type: string;
  readonly from: Time;
  readonly to: Time;
  readonly bucket_s: number;
  readonly low: Values;
  readonly median: Values;
  readonly high: Values;
  readonly sites: readonly ComparedSite[];
}

/** What the server compares at most. */
export const MOST_SITES = 50;
/** So many lines can be told apart beside that of the median. */
export const MOST_DRAWN = 6;
/** The look that no greenhouse gets: grey, with dashes. */
export const MEDIAN_LOOK = 6;

/** The median with its band, and the sites that are drawn, each with the look of its place there. */
export function linesOf(found: Compared, drawn: readonly string[], median: string): Line[] {
  const sites = drawn.flatMap((name, look) => {
    const site = found.sites.find((each) => each.site === name);
    return site ? [lineOf(found, site.name, look, site.means, site.means, site.means)] : [];
  });
  return [lineOf(found, median, MEDIAN_LOOK, found.low, found.median, found.high), ...sites];
}

function lineOf(
  { from, to, bucket_s: bucketS, sensor_type: sensor }: Compared,
  label: string,
  look: number,
  ...[low, mean, high]: [low: Values, mean: Values, high: Values]
): Line {
  const start = secondsOf(from);
  const buckets = mean.flatMap((value, index) =>
    value === null
      ? []
      : [
          {
            ...{ start: start + index * bucketS, n: 1, mean: value },
            ...{ min: low[index] ?? value, max: high[index] ?? value },
          },
        ],
  );
  const gaps = mean.flatMap((value, index) =>
    value === null ? [{ from: start + index * bucketS, to: start + (index + 1) * bucketS }] : [],
  );
  const series = {
    ...{ from: start, to: secondsOf(to), tagId: label, sensor, bucketS },
    ...{ readings: [], buckets, gaps, nights: null, missing: [] },
  };
  return { series, before: null, look, label, marks: [] };
}

export const spanOf = ({ from, to }: Compared): Span => ({
  from: secondsOf(from),
  to: secondsOf(to),
});

/** Of a site, what the bucket at a moment has; of none, its mean. */
export function valueAt(found: Compared, { mean, means }: ComparedSite, at: number | null) {
  if (at === null) return mean;
  return means[Math.floor((at - secondsOf(found.from)) / found.bucket_s)] ?? null;
}
