import { describe, expect, test } from 'vitest';

import type { Mark, Series } from './series';
import { chartCsv, rowsOfSeries } from './seriesTable';
import { CATALOGUE } from '../testing/sensors';

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
