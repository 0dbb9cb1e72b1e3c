import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import { wireTag } from '../testing/tags';
import { pairKey, seriesOver } from './fed';
import { askAgainS, createFeed, type Feed, type Wanted } from './feed';

const pair = { tagId: '1', sensor: 'co2' };
const span = { from: 1_000, to: 4_600 };
const wanted = (over: Partial<Wanted> = {}): Wanted => ({
  pairs: [pair],
  span,
  nowS: span.to,
  period: 'hour',
  points: 300,
  dayS: null,
  epoch: 1,
  ...over,
});

const time = (sec: number): { sec: number; nanosec: number } => ({ sec, nanosec: 0 });
let asked: URL[] = [];
let refuse: Response | null = null;
let buckets: Response | null = null;
let feed: Feed;

/** A bridge that has one reading, and one failed try at the beginning. */
function answer(url: URL): Response {
  if (refuse) return refuse.clone();
  if (buckets && url.pathname.endsWith('/history')) return buckets.clone();
  const query = url.searchParams;
  const [from, to] = [Number(query.get('from')), Number(query.get('to'))];
  const period = { from: time(from), to: time(to) };
  if (url.pathname.endsWith('/history')) {
    return Response.json({
      ...period,
      tag_id: query.get('tag_id'),
      sensor_type: query.get('sensor_type'),
      unit: 'ppm',
      is_bucketed: false,
      bucket_s: null,
      readings: [{ stamp: time(from + 10), value: 600 }],
      buckets: [],
      gaps: [],
      nights: null,
      complete_to: null,
      kept_from: null,
    });
  }
  const bucket = { start: time(from), scans: 1, failures: 1, looks: 0 };
  return Response.json({
    ...period,
    bucket_s: 10,
    reach: null,
    buckets: [{ ...bucket, pests_seen: 0, pests_cleared: 0 }],
    silences: [],
    runs: [],
    complete_to: null,
    kept_from: null,
  });
}

beforeEach(() => {
  vi.useFakeTimers();
  asked = [];
  refuse = null;
  buckets = null;
  vi.stubGlobal('fetch', (url: URL) => {
    asked.push(url);
    return Promise.resolve(answer(url));
  });
  feed = createFeed();
});
afterEach(() => {
  feed.want(null);
  vi.useRealTimers();
});

const settled = async (): Promise<void> => {
  await vi.advanceTimersByTimeAsync(1_000);
};

test('a line is asked for once, with its tag’s timeline', async () => {
  feed.want(wanted());
  feed.want(wanted());
  await settled();
  expect(asked.map(({ pathname, search }) => pathname + search)).toEqual([
    '/api/history?tag_id=1&sensor_type=co2&from=1000.000&to=4600.000&points=300',
    '/api/timeline?points=200&from=1000.000&to=4600.000&tag_id=1',
  ]);
  const fed = feed.get();
  expect(fed.state).toBe('ready');
  expect(fed.series.get(pairKey(pair))?.readings).toEqual([{ at: 1_010, value: 600 }]);
  expect(fed.marks.get('1')).toEqual([{ at: 1_000, widthS: 10, kind: 'failure', count: 1 }]);
});

test('the day before is asked for where it is wanted, and stands a day later than it was', async () => {
  feed.want(wanted());
  await settled();
  expect(feed.get().before.size).toBe(0);
  asked = [];
  feed.want(wanted({ dayS: 600 }));
  await settled();
  expect(asked.map(({ pathname, searchParams }) => [pathname, searchParams.get('from')])).toEqual([
    ['/api/history', '1000.000'],
    ['/api/history', '400.000'],
    ['/api/timeline', '1000.000'],
  ]);
  // At 410 it read 600, ten seconds behind the begin of that period.
  expect(feed.get().before.get(pairKey(pair))).toMatchObject({
    ...{ from: 1_000, to: 4_600 },
    readings: [{ at: 1_010, value: 600 }],
  });
});

test('before the time of a simulation began there is no day to ask for', async () => {
  feed.want(wanted({ dayS: 4_000 }));
  await settled();
  expect(asked.map(({ searchParams }) => searchParams.get('from'))).toContain('0.000');
  asked = [];
  feed.want(wanted({ dayS: 86_400 }));
  await settled();
  expect(asked).toHaveLength(2);
  expect(feed.get()).toMatchObject({ state: 'ready', before: new Map() });
});

test('what is heard is there at once, and nothing is fetched for it', async () => {
  feed.want(wanted());
  await settled();
  const before = asked.length;
  const observed = { name: 'co2', value: 650, observed_at: time(4_601), stale_seconds: 0 };
  feed.hear([wireTag({ readings: [observed] })]);
  await settled();
  expect(asked).toHaveLength(before);
  const grown = seriesOver(feed.get(), pair, { from: 1_002, to: 4_602 });
  expect(grown?.readings.at(-1)).toEqual({ at: 4_601, value: 650 });
});

test('what comes later than was asked is in no bucket, however late the period ends', async () => {
  buckets = Response.json({
    from: time(1_000),
    to: time(4_600),
    tag_id: '1',
    sensor_type: 'co2',
    unit: 'ppm',
    is_bucketed: true,
    bucket_s: 3_600,
    readings: [],
    buckets: [{ start: time(1_000), n: 1, mean: 600, min: 600, max: 600 }],
    gaps: [],
    nights: null,
    complete_to: null,
    kept_from: null,
  });
  feed.want(wanted({ nowS: 2_000 }));
  await settled();
  const observed = { name: 'co2', value: 650, observed_at: time(2_001), stale_seconds: 0 };
  feed.hear([wireTag({ readings: [observed] })]);
  expect(seriesOver(feed.get(), pair, span)?.buckets).toMatchObject([{ n: 2, max: 650 }]);
});

describe('the server is asked anew', () => {
  test('when enough of the period is new, and not before', async () => {
    feed.want(wanted({ span: { from: 0, to: 3_600 } }));
    await settled();
    const before = asked.length;
    feed.want(wanted({ span: { from: 29, to: 3_629 } }));
    await settled();
    expect(asked).toHaveLength(before);
    feed.want(wanted({ span: { from: 30, to: 3_630 } }));
    await settled();
    expect(asked).toHaveLength(2 * before);
    expect(askAgainS({ from: 0, to: 3_600 })).toBe(30);
    expect(askAgainS({ from: 0, to: 20_000 })).toBe(100);
    expect(askAgainS({ from: 0, to: 1e9 })).toBe(300);
  });

  test('after a reconnect, and what is there stays meanwhile', async () => {
    feed.want(wanted());
    await settled();
    const before = asked.length;
    feed.want(wanted({ epoch: 2 }));
    expect(feed.get().state).toBe('ready');
    await settled();
    expect(asked).toHaveLength(2 * before);
  });

  test('for another period at once', async () => {
    feed.want(wanted());
    await settled();
    const before = asked.length;
    feed.want(wanted({ period: 'own', span: { from: 2_000, to: 2_100 } }));
    expect(asked).toHaveLength(2 * before);
    expect(feed.get()).toMatchObject({ state: 'waiting' });
    expect(feed.get().series.size).toBe(1);
  });
});

describe('where there is nothing', () => {
  test('a twin without a past is told from one that cannot answer now', async () => {
    refuse = Response.json({ detail: 'no journal is kept' }, { status: 404 });
    feed.want(wanted());
    await settled();
    expect(feed.get()).toMatchObject({ state: 'missing', message: 'no journal is kept' });
    refuse = Response.json({ detail: 'too many' }, { status: 503 });
    feed.want(wanted({ period: 'day' }));
    await settled();
    expect(feed.get()).toMatchObject({ state: 'failed', message: 'too many' });
  });

  test('a failure heals by itself', async () => {
    refuse = Response.json({ detail: 'busy' }, { status: 503 });
    feed.want(wanted());
    await settled();
    refuse = null;
    await vi.advanceTimersByTimeAsync(5_000);
    expect(feed.get()).toMatchObject({ state: 'ready', message: '' });
  });
});
