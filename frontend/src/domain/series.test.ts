import { describe, expect, test } from 'vitest';

import { CATALOGUE } from '../testing/sensors';
import { seriesWith } from '../testing/series';
import {
  chartCsv,
  lastUntil,
  type Mark,
  middleOf,
  pointAt,
  rowsOfSeries,
  type Series,
  summaryOf,
} from './series';

const every10 = (count: number): Series['readings'] =>
  Array.from({ length: count }, (_, index) => ({ at: index * 10, value: index }));

const bucket = (start: number, n = 10, mean = 5): Series['buckets'][number] => ({
  start,
  n,
  mean,
  min: mean - 1,
  max: mean + 1,
});

test('a bucket stands in its middle, and never later than the period', () => {
  const bucketed = seriesWith({ bucketS: 10, buckets: [bucket(0)], to: 4 });
  expect(middleOf(bucket(0), { ...bucketed, to: 100 })).toBe(5);
  expect(middleOf(bucket(0), bucketed)).toBe(4);
});

test('a summary counts readings, and takes the least and the most of buckets', () => {
  expect(summaryOf(seriesWith())).toEqual({
    count: 0,
    latest: null,
    min: null,
    max: null,
    gaps: 0,
  });
  const failed = { at: 50, value: null };
  expect(summaryOf(seriesWith({ readings: [...every10(5), failed] }))).toEqual({
    count: 5,
    latest: { at: 40, value: 4 },
    min: 0,
    max: 4,
    gaps: 0,
  });
  const bucketed = seriesWith({ bucketS: 10, buckets: [bucket(0, 3, 5), bucket(10, 4, 6)] });
  expect(summaryOf({ ...bucketed, gaps: [{ from: 20, to: 30 }] })).toEqual({
    count: 7,
    latest: { at: 10, value: 6 },
    min: 4,
    max: 7,
    gaps: 1,
  });
});

test('at a moment there is the reading that held, or the bucket that holds it, and nothing in a gap', () => {
  const readings = every10(3);
  expect(pointAt(seriesWith({ readings }), 14)).toEqual({ at: 10, value: 1 });
  // Table and card say the same of that moment.
  expect(pointAt(seriesWith({ readings }), 16)).toEqual({ at: 10, value: 1 });
  expect(pointAt(seriesWith({ readings, gaps: [{ from: 20, to: 90 }] }), 21)).toBeNull();
  expect(pointAt(seriesWith(), 21)).toBeNull();
  const bucketed = seriesWith({ bucketS: 10, buckets: [bucket(0), bucket(30)] });
  expect(pointAt(bucketed, 39.9)).toEqual(bucket(30));
  expect(pointAt(bucketed, 40)).toBeNull();
  expect(pointAt(bucketed, 29.9)).toBeNull();
});

test('at a moment the last that had been read counts, never a later one', () => {
  const readings = every10(3);
  expect(lastUntil(seriesWith({ readings }), 19.9)).toEqual({ at: 10, value: 1 });
  expect(lastUntil(seriesWith({ readings }), 20)).toEqual({ at: 20, value: 2 });
  expect(lastUntil(seriesWith({ readings }), Infinity)).toEqual({ at: 20, value: 2 });
  expect(lastUntil(seriesWith({ readings }), -1)).toBeNull();
  const buckets = [bucket(0), bucket(50)];
  expect(lastUntil(seriesWith({ bucketS: 50, buckets }), 49)).toEqual(bucket(0));
});

/** Noon, 21 November 2026, UTC. */
const NOON = 1_795_262_400;

const series: Series = {
  tagId: '=2+5',
  sensor: 'temperature',
  from: NOON,
  to: NOON + 100,
  bucketS: null,
  readings: [
    { at: NOON, value: 20 },
    { at: NOON + 10.5, value: null },
  ],
  buckets: [],
  gaps: [{ from: NOON + 10.5, to: NOON + 100 }],
  nights: null,
  missing: [{ from: NOON + 150, to: NOON + 200, why: 'not_recorded' }],
};
const bucketed = (from: number): Series => ({
  ...series,
  from,
  to: from + 100,
  bucketS: 10,
  readings: [],
  buckets: [{ start: from, n: 4, mean: 21, min: 20, max: 23 }],
  gaps: [],
  missing: [],
});
const failure = (at: number): Mark => ({ at, widthS: 10, kind: 'failure', count: 2 });

describe('the rows of a chart', () => {
  test('are readings, gaps and marks by their time', () => {
    expect(rowsOfSeries(series, [failure(NOON)])).toEqual([
      { kind: 'reading', at: NOON, value: 20 },
      { kind: 'failure', at: NOON, to: NOON + 10, count: 2 },
      { kind: 'gap', at: NOON + 10.5, to: NOON + 100 },
      { kind: 'reading', at: NOON + 10.5, value: null },
      { kind: 'not_recorded', at: NOON + 150, to: NOON + 200 },
    ]);
  });

  test('are buckets with their ends', () => {
    expect(rowsOfSeries(bucketed(NOON), [])).toEqual([
      { kind: 'bucket', at: NOON, to: NOON + 10, n: 4, mean: 21, min: 20, max: 23 },
    ]);
  });

  test('leave out marks of another period', () => {
    const marks = [989, 990, 1_099, 1_100].map(failure);
    const kept = rowsOfSeries(bucketed(1_000), marks).filter(({ kind }) => kind === 'failure');
    expect(kept.map(({ at }) => at)).toEqual([990, 1_099]);
  });
});

describe('as CSV', () => {
  const lines = (text: string): string[] => text.trimEnd().split('\r\n');

  test('each row tells what it is, and no tag becomes a formula', () => {
    expect(lines(chartCsv(CATALOGUE, [{ series, marks: [failure(NOON)] }], 'C'))).toEqual([
      '\ufefftime_iso,stamp,until,tag_id,sensor,unit,kind,n,value,min,max',
      `2026-11-21T12:00:00.000Z,${NOON},,'=2+5,temperature,°C,reading,1,20,,`,
      `2026-11-21T12:00:00.000Z,${NOON},${NOON + 10},'=2+5,temperature,°C,failure,2,,,`,
      `2026-11-21T12:00:10.500Z,${NOON + 10.5},${NOON + 100},'=2+5,temperature,°C,gap,0,,,`,
      `2026-11-21T12:00:10.500Z,${NOON + 10.5},,'=2+5,temperature,°C,reading,1,,,`,
      `2026-11-21T12:02:30.000Z,${NOON + 150},${NOON + 200},'=2+5,temperature,°C,not_recorded,,,,`,
    ]);
  });

  test('values are in the unit that is shown, and a simulated clock has no dates', () => {
    expect(lines(chartCsv(CATALOGUE, [{ series: bucketed(1_000), marks: [] }], 'F'))[1]).toBe(
      ",1000,1010,'=2+5,temperature,°F,bucket,4,69.8,68,73.4",
    );
  });
});
