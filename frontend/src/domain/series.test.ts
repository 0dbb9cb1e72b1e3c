import { describe, expect, test } from 'vitest';

import { CATALOGUE, IN_FAHRENHEIT } from '../testing/sensors';
import { bucketAt, seriesWith } from '../testing/timeline';
import {
  chartCsv,
  lastUntil,
  type Mark,
  middleOf,
  pointAt,
  readingAt,
  rowsOfSeries,
  type Series,
} from './series';

const every10 = Array.from({ length: 3 }, (_, index) => readingAt(index * 10, index));

test('a bucket stands in its middle, and never later than the period, or in a gap', () => {
  expect(middleOf(bucketAt(0, 5), seriesWith({ bucketS: 10 }))).toBe(5);
  expect(middleOf(bucketAt(0, 5), seriesWith({ bucketS: 10, to: 4 }))).toBe(4);
  // What it has was read before the gap, or after it.
  const gaps = [{ from: 4, to: 27 }];
  expect(middleOf(bucketAt(0, 5), seriesWith({ bucketS: 10, gaps, to: 90 }))).toBe(4);
  expect(middleOf(bucketAt(20, 5), seriesWith({ bucketS: 10, gaps, to: 90 }))).toBe(27);
});

test('at a moment there is the reading that held, or the bucket that holds it, and nothing in a gap', () => {
  expect(pointAt(seriesWith({ points: every10 }), 14)).toEqual(readingAt(10, 1));
  // Table and card say the same of that moment.
  expect(pointAt(seriesWith({ points: every10 }), 16)).toEqual(readingAt(10, 1));
  expect(pointAt(seriesWith({ points: every10, gaps: [{ from: 20, to: 90 }] }), 21)).toBeNull();
  expect(pointAt(seriesWith(), 21)).toBeNull();
  const bucketed = seriesWith({ bucketS: 10, points: [bucketAt(0, 5), bucketAt(30, 5)] });
  expect(pointAt(bucketed, 39.9)).toEqual(bucketAt(30, 5));
  expect(pointAt(bucketed, 40)).toBeNull();
  expect(pointAt(bucketed, 29.9)).toBeNull();
});

test('at a moment the last that had been read counts, never a later one', () => {
  expect(lastUntil(seriesWith({ points: every10 }), 19.9)).toEqual(readingAt(10, 1));
  expect(lastUntil(seriesWith({ points: every10 }), 20)).toEqual(readingAt(20, 2));
  expect(lastUntil(seriesWith({ points: every10 }), Infinity)).toEqual(readingAt(20, 2));
  expect(lastUntil(seriesWith({ points: every10 }), -1)).toBeNull();
  const points = [bucketAt(0, 5), bucketAt(50, 5)];
  expect(lastUntil(seriesWith({ bucketS: 50, points }), 49)).toEqual(bucketAt(0, 5));
});

/** Noon, 21 November 2026, UTC. */
const NOON = 1_795_262_400;

const series: Series = {
  tagId: '=2+5',
  sensor: 'temperature',
  from: NOON,
  to: NOON + 100,
  bucketS: null,
  points: [readingAt(NOON, 20), readingAt(NOON + 10.5, null)],
  gaps: [{ from: NOON + 10.5, to: NOON + 100 }],
  nights: null,
  missing: [{ from: NOON + 150, to: NOON + 200, why: 'not_recorded' }],
};
const bucketed = (from: number): Series => ({
  ...series,
  from,
  to: from + 100,
  bucketS: 10,
  points: [{ at: from, n: 4, value: 21, min: 20, max: 23 }],
  gaps: [],
  missing: [],
});
const failure = (at: number): Mark => ({ at, widthS: 10, kind: 'failure', count: 2 });

describe('the rows of a chart', () => {
  test('are readings, gaps and marks by their time', () => {
    const rows = rowsOfSeries(series, [failure(NOON)]);
    expect(
      rows.map(({ kind, at, to, value, n }) => [kind, at - NOON, to && to - NOON, value, n]),
    ).toEqual([
      ['reading', 0, null, 20, 1],
      ['failure', 0, 10, null, 2],
      ['gap', 10.5, 100, null, 0],
      ['reading', 10.5, null, null, 1],
      ['not_recorded', 150, 200, null, null],
    ]);
  });

  test('are buckets with their ends', () => {
    expect(rowsOfSeries(bucketed(NOON), [])).toEqual([
      { kind: 'bucket', at: NOON, to: NOON + 10, n: 4, value: 21, min: 20, max: 23 },
    ]);
  });

  test('leave out marks of another period', () => {
    const marks = [989, 990, 1_099, 1_100].map(failure);
    const failures = rowsOfSeries(bucketed(1_000), marks).filter(({ kind }) => kind === 'failure');
    expect(failures.map(({ at }) => at)).toEqual([990, 1_099]);
  });
});

describe('as CSV', () => {
  const lines = (text: string): string[] => text.trimEnd().split('\r\n');

  test('each row has its kind, and no tag id becomes a formula', () => {
    expect(lines(chartCsv(CATALOGUE, [{ series, marks: [failure(NOON)] }]))).toEqual([
      '\ufefftime_iso,stamp,until,tag_id,sensor,unit,kind,n,value,min,max',
      `2026-11-21T12:00:00.000Z,${NOON},,'=2+5,temperature,°C,reading,1,20,,`,
      `2026-11-21T12:00:00.000Z,${NOON},${NOON + 10},'=2+5,temperature,°C,failure,2,,,`,
      `2026-11-21T12:00:10.500Z,${NOON + 10.5},${NOON + 100},'=2+5,temperature,°C,gap,0,,,`,
      `2026-11-21T12:00:10.500Z,${NOON + 10.5},,'=2+5,temperature,°C,reading,1,,,`,
      `2026-11-21T12:02:30.000Z,${NOON + 150},${NOON + 200},'=2+5,temperature,°C,not_recorded,,,,`,
    ]);
  });

  test('values are in the unit that is shown, and a simulated clock has no dates', () => {
    expect(lines(chartCsv(IN_FAHRENHEIT, [{ series: bucketed(1_000), marks: [] }]))[1]).toBe(
      ",1000,1010,'=2+5,temperature,°F,bucket,4,69.8,68,73.4",
    );
  });
});
