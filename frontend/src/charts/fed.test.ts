import { describe, expect, test } from 'vitest';

import type { Series } from '../domain/series';
import { seriesWith } from '../testing/series';
import { wireTag } from '../testing/tags';
import {
  marksOver,
  NOTHING_FED,
  pairKey,
  seriesOver,
  withFetched,
  withOnly,
  withState,
  type Fed,
} from './fed';

const pair = { tagId: '1', sensor: 'co2' };
const key = pairKey(pair);
const readings = [
  { at: 80, value: 1 },
  { at: 90, value: 2 },
];
const series = (over: Partial<Series> = {}): Series => seriesWith({ ...pair, readings, ...over });
const fetched = (one: Series = series()): Fed =>
  withFetched(NOTHING_FED, {
    until: 100,
    series: new Map([[key, one]]),
    marks: new Map(),
    before: new Map(),
  });
const reading = (sec: number, value: number, over = {}): ReturnType<typeof wireTag> =>
  wireTag({
    readings: [{ name: 'co2', value, observed_at: { sec, nanosec: 0 }, stale_seconds: 0 }],
    ...over,
  });
const span = { from: 0, to: 200 };
const values = (fed: Fed): unknown[] =>
  seriesOver(fed, pair, span)?.readings.map(({ value }) => value) ?? [];

describe('a state of the twin', () => {
  test('brings the reading that is new, and the same one changes nothing', () => {
    const once = withState(fetched(), [pair], [reading(110, 3)]);
    expect(values(once)).toEqual([1, 2, 3]);
    expect(withState(once, [pair], [reading(110, 3)])).toBe(once);
    expect(withState(once, [pair], [reading(90, 2)])).toBe(once);
  });

  test('brings nothing of other lines, nor what has no time', () => {
    const fed = fetched();
    expect(withState(fed, [pair], [reading(110, 3, { tag_id: '2' })])).toBe(fed);
    expect(withState(fed, [{ ...pair, sensor: 'light' }], [reading(110, 3)])).toBe(fed);
    const timeless = wireTag({
      readings: [{ name: 'co2', value: 3, observed_at: null, stale_seconds: null }],
    });
    expect(withState(fed, [pair], [timeless])).toBe(fed);
  });

  test('brings looks and tries that came to nothing, each once', () => {
    const tag = wireTag({
      looked_at: { sec: 120, nanosec: 0 },
      last_try: { sec: 130, nanosec: 0 },
      last_try_status: 2,
    });
    const once = withState(fetched(), [pair], [tag]);
    expect(marksOver(once, '1', span)).toEqual([
      { at: 120, widthS: 0, kind: 'look', count: 1 },
      { at: 130, widthS: 0, kind: 'failure', count: 1 },
    ]);
    expect(withState(once, [pair], [tag])).toBe(once);
    // One that succeeded is told by its readings.
    expect(
      withState(fetched(), [pair], [{ ...tag, looked_at: null, last_try_status: 0 }]).heardMarks
        .size,
    ).toBe(0);
  });

  test('brings no reading that is in the last bucket', () => {
    const bucket = { start: 80, n: 1, mean: 2, min: 2, max: 2 };
    const fed = fetched(series({ bucketS: 40, readings: [], buckets: [bucket] }));
    expect(withState(fed, [pair], [reading(100, 2)])).toBe(fed);
    const later = withState(fed, [pair], [reading(101, 4)]);
    expect(seriesOver(later, pair, span)?.buckets).toEqual([
      { start: 80, n: 2, mean: 3, min: 2, max: 4 },
    ]);
  });

  test('tells of no look that the timeline has in a bucket', () => {
    const look = { at: 115, widthS: 10, kind: 'look' as const, count: 1 };
    const told = withFetched(NOTHING_FED, {
      until: 100,
      series: new Map(),
      marks: new Map([['1', [look]]]),
      before: new Map(),
    });
    const tag = (sec: number): ReturnType<typeof wireTag> =>
      wireTag({ looked_at: { sec, nanosec: 0 } });
    expect(withState(told, [pair], [tag(125)])).toBe(told);
    expect(withState(told, [pair], [tag(126)])).not.toBe(told);
  });
});

describe('an answer of the server', () => {
  test('takes the place of what was heard, but for what it does not have yet', () => {
    let fed = withState(fetched(), [pair], [reading(110, 3)]);
    fed = withState(fed, [pair], [reading(120, 4)]);
    const answer = series({ to: 121, readings: [{ at: 110, value: 3 }] });
    const next = withFetched(fed, {
      until: 120,
      series: new Map([[key, answer]]),
      marks: new Map(),
      before: new Map(),
    });
    expect(next.heard.get(key)).toEqual([{ at: 120, value: 4 }]);
    expect(values(next)).toEqual([3, 4]);
  });

  test('in buckets has all up to its end', () => {
    let fed = withState(fetched(), [pair], [reading(110, 3)]);
    fed = withState(fed, [pair], [reading(130, 4)]);
    const bucket = { start: 100, n: 1, mean: 3, min: 3, max: 3 };
    // The last bucket is not over yet.
    const answer = series({ to: 140, bucketS: 40, readings: [], buckets: [bucket] });
    const next = withFetched(fed, {
      until: 120,
      series: new Map([[key, answer]]),
      marks: new Map(),
      before: new Map(),
    });
    expect(next.heard.get(key)).toEqual([{ at: 130, value: 4 }]);
  });
});

test('another question keeps what is of the same lines until its answer is here', () => {
  const heard = withState(fetched(), [pair], [reading(110, 3)]);
  const same = withOnly(heard, [pair]);
  expect(same.state).toBe('waiting');
  expect(values(same)).toEqual([1, 2, 3]);
  const other = withOnly(heard, [{ tagId: '2', sensor: 'co2' }]);
  expect(seriesOver(other, pair, span)).toBeNull();
  expect(other.heard.size).toBe(0);
});
