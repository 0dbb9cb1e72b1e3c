import { act as flush, renderHook } from '@testing-library/react';
import { afterAll, beforeAll, beforeEach, describe, expect, test, vi } from 'vitest';

import { timelineOf } from '../domain/timeline';
import { act, receive } from '../store/app';
import { ready } from '../store/fetcher';
import { withState } from '../store/twin';
import { DEFAULT_VIEW } from '../store/view';
import { goLive, goLost, showTags, status } from '../testing/page';
import { stateFrame, wireTag } from '../testing/tags';
import { wireTimeline } from '../testing/timeline';
import type { Line } from './model';
import { useCharts, type Charts } from './useCharts';

/** From here on, the last hour is refetched every 15 s. */
const NOW_S = 99_990;

let requested: URL[] = [];
let refuse: Response | null = null;

/** A bridge that has one reading, and one failed attempt at the beginning. */
function answer(url: URL): Response {
  if (refuse) return refuse.clone();
  const query = url.searchParams;
  const [from, to] = [Number(query.get('from')), Number(query.get('to'))];
  const bounds = { from: from, to: to, complete_to: null, kept_from: null };
  if (url.pathname.endsWith('/history')) {
    return Response.json({
      ...bounds,
      tag_id: query.get('tag_id'),
      sensor_type: query.get('sensor_type'),
      unit: 'ppm',
      is_bucketed: false,
      bucket_s: null,
      readings: [{ stamp: from + 10, value: 600 }],
      buckets: [],
      gaps: [],
      nights: null,
    });
  }
  const bucket = { start: from, scans: 1, failures: 1, looks: 0 };
  return Response.json({
    ...bounds,
    bucket_s: 10,
    reach: null,
    buckets: [{ ...bucket, pests_seen: 0, pests_cleared: 0 }],
    silences: [],
    runs: [],
  });
}

/** A state with the tag as visited at a moment. */
function visit(sec: number, over: Parameters<typeof wireTag>[0] = {}): void {
  flush(() => {
    const latest = stateFrame([wireTag({ last_observed: sec, ...over })], { sec });
    receive(withState(latest, performance.now()));
  });
}

const passed = (ms: number): Promise<void> =>
  flush(async () => {
    await vi.advanceTimersByTimeAsync(ms);
  });

const sinceOf = (path: string): number[] =>
  requested
    .filter(({ pathname }) => pathname === path)
    .map(({ searchParams }) => Number(searchParams.get('from')));
const histories = (): number[] => sinceOf('/api/history');

const show = (hasDayBefore = false): { readonly current: Charts } =>
  renderHook(() => useCharts(['co2'], ['1'], 300, hasDayBefore)).result;
const lineOf = ({ models }: Charts): Line | undefined => models[0]?.lines[0];

beforeAll(() => {
  vi.useFakeTimers();
});
beforeEach(() => {
  requested = [];
  refuse = null;
  vi.stubGlobal('fetch', (url: URL) => {
    requested.push(url);
    return Promise.resolve(answer(url));
  });
  showTags([]);
  act({ period: { kind: 'hour' } });
  visit(NOW_S);
});
afterAll(() => {
  vi.useRealTimers();
});

test('a line is fetched once, with its tag’s timeline', async () => {
  const shown = show();
  expect(shown.current.state).toBe('waiting');
  await passed(100);
  expect(requested.map(({ pathname }) => pathname)).toEqual(['/api/history', '/api/timeline']);
  const from = NOW_S - 3_600;
  expect(shown.current.state).toBe('ready');
  const line = lineOf(shown.current);
  expect(line?.series.points).toMatchObject([{ value: 600 }]);
  expect(line?.marks).toMatchObject([{ widthS: 10, kind: 'failure', count: 1 }]);
  expect(histories()[0]).toBeCloseTo(from, 0);
});

describe('the day before', () => {
  test('is fetched if enabled, and shifted by a day', async () => {
    const shown = show(true);
    await passed(100);
    const [today = 0, yesterday = 0] = histories();
    expect(today - yesterday).toBeCloseTo(86_400);
    const { series, before } = lineOf(shown.current) ?? {};
    expect(before?.from).toBeCloseTo(series?.from ?? 0);
    expect(before?.points).toMatchObject([{ value: 600 }]);
  });

  test('is not fetched from before a simulation began', async () => {
    flush(() => {
      goLive(status({ day_length_s: NOW_S + 3_600 }));
    });
    const shown = show(true);
    await passed(100);
    expect(histories()).toHaveLength(1);
    expect(shown.current.state).toBe('ready');
    expect(lineOf(shown.current)?.before).toBeNull();
  });
});

describe('lines are fetched again', () => {
  test('after a visit, once the journal has it, and at most once in three seconds', async () => {
    show();
    await passed(100);
    visit(NOW_S + 1);
    visit(NOW_S + 2, { last_try: NOW_S + 2 });
    await passed(3_000);
    expect(histories()).toHaveLength(1);
    await passed(1_500);
    expect(histories()).toHaveLength(2);
    // Up to the time of the request, not of the visit.
    expect(histories()[1]).toBeGreaterThan(NOW_S + 2 - 3_600);
    await passed(5_000);
    expect(histories()).toHaveLength(2);
  });

  test('at the time bar’s interval without visits', async () => {
    show();
    await passed(100);
    await passed(64_000);
    expect(histories()).toHaveLength(1 + 2);
  });

  test('after a reconnect, and what is there stays meanwhile', async () => {
    const shown = show();
    await passed(100);
    flush(goLost);
    await passed(20_000);
    expect(histories()).toHaveLength(1);
    flush(goLive);
    expect(shown.current.state).toBe('ready');
    await passed(1_500);
    expect(histories()).toHaveLength(2);
  });

  test('for another period at once, and what is there stays meanwhile', async () => {
    const shown = show();
    await passed(100);
    flush(() => {
      act({ period: { kind: 'own', from: 2_000, to: 2_100 } });
    });
    expect(shown.current.state).toBe('waiting');
    expect(lineOf(shown.current)).toBeDefined();
    await passed(10);
    expect(histories()[1]).toBe(2_000);
    // The period has ended: later data do not belong to it.
    visit(NOW_S + 1);
    await passed(60_000);
    expect(histories()).toHaveLength(2);
  });

  // An abandoned request still counts against what one client may have under way.
  test.each([
    ['all of the past', { kind: 'all' } as const, 7_200],
    ['the period that the page opens on', DEFAULT_VIEW.period, NOW_S - 86_400],
  ])('for %s once it is known how far that reaches, and only then', async (_, period, from) => {
    act({ period });
    show();
    await passed(100);
    expect(histories()).toEqual([]);
    const value = timelineOf(wireTimeline({ from: 7_200, to: NOW_S }), NOW_S);
    flush(() => {
      receive({ remembered: ready(value) });
    });
    await passed(100);
    expect(histories().map(Math.round)).toEqual([from]);
  });

  test('for no visit while the page shows the past', async () => {
    show();
    await passed(100);
    flush(() => {
      act({ moment: NOW_S - 100 });
    });
    visit(NOW_S + 1);
    await passed(5_000);
    expect(histories()).toHaveLength(1);
  });
});

describe('where there is nothing', () => {
  test('a failure heals by itself, as soon as any other', async () => {
    refuse = Response.json({ detail: 'busy' }, { status: 503 });
    const shown = show();
    await passed(100);
    expect(shown.current).toMatchObject({ state: 'failed', message: 'busy' });
    refuse = null;
    await passed(2_400);
    expect(shown.current).toMatchObject({ state: 'ready', message: '' });
  });

  test('lines of the last period do not stay if those of the next cannot be fetched', async () => {
    const shown = show();
    await passed(100);
    expect(lineOf(shown.current)).toBeDefined();
    refuse = Response.json({ detail: 'busy' }, { status: 503 });
    flush(() => {
      act({ period: { kind: 'own', from: 2_000, to: 2_100 } });
    });
    await passed(4_000);
    expect(shown.current).toMatchObject({ state: 'failed', message: 'busy' });
    expect(lineOf(shown.current)).toBeUndefined();
  });
});
