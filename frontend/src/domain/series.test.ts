import { describe, expect, test } from 'vitest';

import { CATALOGUE } from '../testing/sensors';
import { seriesWith } from '../testing/series';
import {
  chartCsv,
  goneOn,
  lastTime,
  lastUntil,
  type Mark,
  middleOf,
  pointAt,
  quietS,
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

describe('what is heard after the fetch', () => {
  test('is appended once, and only what is newer than all that is there', () => {
    const base = seriesWith({ readings: every10(5) });
    const heard = [
      { at: 40, value: 99 },
      { at: 50, value: 5 },
      { at: 50, value: 6 },
    ];
    expect(goneOn(base, heard, { from: 0, to: 60 }).readings).toEqual([
      ...every10(5),
      { at: 50, value: 5 },
    ]);
  });

  test('of later than the period does not belong to it', () => {
    const base = seriesWith({ readings: every10(5) });
    const later = { at: 61, value: 5 };
    expect(goneOn(base, [later], { from: 0, to: 60 }).readings).toHaveLength(5);
  });

  test('falls into the last bucket, or into one of its own on the same grid', () => {
    const base = seriesWith({ bucketS: 10, buckets: [bucket(0), bucket(10, 1, 4)] });
    const heard = [
      { at: 19.9, value: 8 },
      { at: 25, value: 7 },
      { at: 26, value: null },
    ];
    const { buckets } = goneOn(base, heard, { from: 0, to: 30 });
    expect(buckets).toEqual([
      bucket(0),
      { start: 10, n: 2, mean: 6, min: 3, max: 8 },
      { start: 20, n: 1, mean: 7, min: 7, max: 7 },
    ]);
  });

  test('leaves nothing from before the period', () => {
    expect(goneOn(seriesWith({ readings: every10(5) }), [], { from: 20, to: 60 }).readings).toEqual(
      every10(5).slice(2),
    );
    const bucketed = seriesWith({ bucketS: 10, buckets: [bucket(0), bucket(10)] });
    // A bucket that ends with the beginning of the period is not in it.
    expect(goneOn(bucketed, [], { from: 10, to: 60 }).buckets).toEqual([bucket(10)]);
    expect(goneOn(bucketed, [], { from: 9.9, to: 60 }).buckets).toHaveLength(2);
  });
});

describe('a gap', () => {
  test('opens when nothing comes for more than three times the usual, and not before', () => {
    const base = seriesWith({ readings: every10(5) });
    expect(quietS(base)).toBe(30);
    expect(goneOn(base, [], { from: 0, to: 70 }).gaps).toEqual([]);
    expect(goneOn(base, [], { from: 0, to: 70.5 }).gaps).toEqual([{ from: 40, to: 70.5 }]);
  });

  test('that was open closes at the reading that ends it', () => {
    const base = seriesWith({ readings: every10(5), gaps: [{ from: 40, to: 100 }] });
    const period = { from: 0, to: 120 };
    expect(goneOn(base, [{ at: 110, value: 1 }], period).gaps).toEqual([{ from: 40, to: 110 }]);
    // It turns out that it was none: a reading of before was late.
    expect(goneOn(base, [{ at: 60, value: 1 }], { from: 0, to: 80 }).gaps).toEqual([]);
  });

  test('leaves with the period, and is cut at its ends', () => {
    const base = seriesWith({ readings: every10(5).slice(3), gaps: [{ from: 0, to: 30 }] });
    expect(goneOn(base, [], { from: 20, to: 60 }).gaps).toEqual([{ from: 20, to: 30 }]);
    expect(goneOn(base, [], { from: 30, to: 60 }).gaps).toEqual([]);
  });

  test('of a series with nothing in it is all of the period', () => {
    const base = seriesWith({ gaps: [{ from: 0, to: 100 }] });
    expect(goneOn(base, [], { from: 0, to: 100 }).gaps).toEqual([{ from: 0, to: 100 }]);
    expect(goneOn(base, [{ at: 70, value: 1 }], { from: 0, to: 100 }).gaps).toEqual([
      { from: 0, to: 70 },
    ]);
  });

  test('between buckets is never shorter than one', () => {
    const base = seriesWith({ bucketS: 10, buckets: [bucket(0, 100), bucket(10, 100)] });
    expect(quietS(base)).toBe(10);
    const heard = [{ at: 45, value: 5 }];
    expect(goneOn(base, heard, { from: 0, to: 50 }).gaps).toEqual([{ from: 20, to: 40 }]);
    expect(quietS(seriesWith({ bucketS: 10, buckets: [bucket(0, 1)] }))).toBe(Infinity);
  });
});

test('a bucket stands in its middle, and never later than the period', () => {
  const bucketed = seriesWith({ bucketS: 10, buckets: [bucket(0)], to: 4 });
  expect(middleOf(bucket(0), { ...bucketed, to: 100 })).toBe(5);
  expect(middleOf(bucket(0), bucketed)).toBe(4);
});

test('the last of a series is its last reading, or the end of its last bucket', () => {
  expect(lastTime(seriesWith())).toBeNull();
  expect(lastTime(seriesWith({ readings: every10(3) }))).toBe(20);
  expect(lastTime(seriesWith({ bucketS: 10, buckets: [bucket(30)] }))).toBe(40);
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

test('at a moment there is the nearest reading, or the bucket that holds it, and nothing in a gap', () => {
  const readings = every10(3);
  expect(pointAt(seriesWith({ readings }), 14)).toEqual({ at: 10, value: 1 });
  expect(pointAt(seriesWith({ readings }), 16)).toEqual({ at: 20, value: 2 });
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
