import { describe, expect, test, vi } from 'vitest';

import { wireTimeline } from '../testing/timeline';
import { missingOf, tickStep, timelineOf, timeTicks } from './timeline';

test('a timeline says what it lacks', () => {
  const wire = wireTimeline({
    from: 100,
    to: 340,
    reach: { from: 20, to: 340.5 },
    buckets: [
      {
        start: 101.5,
        scans: 5,
        failures: 1,
        looks: 2,
        pests_seen: 3,
        pests_cleared: 4,
      },
    ],
    silences: [{ from: 110, to: 120 }],
    runs: [{ from: 20, to: 340, is_simulated: true }],
  });
  expect(timelineOf({ ...wire, kept_from: 105 }, 400)).toEqual({
    from: 100,
    to: 340,
    bucket_s: 1,
    complete_to: 340,
    kept_from: 105,
    reach: { from: 20, to: 340.5 },
    buckets: [{ start: 101.5, scans: 5, failures: 1, looks: 2, pests_seen: 3, pests_cleared: 4 }],
    silences: [{ from: 110, to: 120 }],
    runs: [{ from: 20, to: 340, is_simulated: true }],
    missing: [{ from: 100, to: 105, why: 'not_kept' }],
  });
  expect(timelineOf({ ...wire, reach: null }, 400).reach).toBeNull();
});

const reported = (
  keptFrom: number | null,
  completeTo: number | null,
): Parameters<typeof missingOf>[0] => ({
  from: 100,
  to: 200,
  kept_from: keptFrom,
  complete_to: completeTo,
});

test('what is kept and complete, or of which nobody knows, misses nothing', () => {
  expect(missingOf(reported(100, 200), 300)).toEqual([]);
  expect(missingOf(reported(null, null), 300)).toEqual([]);
});

test('before what is kept, and behind what is complete, something is missing', () => {
  expect(missingOf(reported(120, 160), 300)).toEqual([
    { from: 100, to: 120, why: 'not_kept' },
    { from: 160, to: 200, why: 'not_recorded' },
  ]);
});

test('what has not come yet is not missing, nor what is about to be written', () => {
  expect(missingOf(reported(100, 150), 155)).toEqual([]);
  expect(missingOf(reported(100, 150), 156)).toEqual([{ from: 150, to: 156, why: 'not_recorded' }]);
});

/** By the operator's clock, whatever zone the tests run in. */
const local = (text: string): number => new Date(text).getTime() / 1000;
const texts = (from: string, to: string, most: number): string[] =>
  timeTicks({ from: local(from), to: local(to) }, most, false).map(({ text }) => text);

test('a step is the shortest round one that fits', () => {
  expect(tickStep({ from: 0, to: 60 }, 6)).toBe(10);
  expect(tickStep({ from: 0, to: 61 }, 6)).toBe(15);
  expect(tickStep({ from: 0, to: 86_400 }, 8)).toBe(3 * 3_600);
  expect(tickStep({ from: 0, to: 365 * 86_400 }, 7)).toBe(60 * 86_400);
  expect(tickStep({ from: 0, to: 40 * 365 * 86_400 }, 4)).toBe(10 * 365 * 86_400);
  expect(tickStep({ from: 0, to: 60 }, 0)).toBe(60);
});

describe('ticks', () => {
  test('of hours tell the date at the first and at midnight', () => {
    expect(texts('2026-05-01T15:10:00', '2026-05-02T08:00:00', 6)).toEqual([
      '18:00\n1 May',
      '21:00',
      '00:00\n2 May',
      '03:00',
      '06:00',
    ]);
  });

  test('of seconds tell them', () => {
    expect(texts('2026-05-01T15:10:05', '2026-05-01T15:10:30', 3)).toEqual([
      '15:10:10\n1 May',
      '15:10:20',
      '15:10:30',
    ]);
  });

  test('of days begin at midnight, those of weeks on Mondays', () => {
    expect(texts('2026-05-01T15:00:00', '2026-05-04T15:00:00', 3)).toEqual([
      '2 May\n2026',
      '3 May',
      '4 May',
    ]);
    expect(texts('2026-05-01T15:00:00', '2026-05-20T15:00:00', 3)).toEqual([
      '4 May\n2026',
      '11 May',
      '18 May',
    ]);
  });

  test('begin at midnight also behind a day that has none', () => {
    vi.stubEnv('TZ', 'America/Santiago');
    const span = { from: local('2026-09-05T12:00:00'), to: local('2026-09-08T12:00:00') };
    const times = timeTicks(span, 3, false).map(({ at }) => new Date(at * 1000).getHours());
    expect(times).toEqual([1, 0, 0]);
    vi.unstubAllEnvs();
  });

  test('of months are their first days, and tell the year', () => {
    expect(texts('2026-10-05T00:00:00', '2027-03-01T12:00:00', 6)).toEqual([
      'Nov\n2026',
      'Dec',
      'Jan\n2027',
      'Feb',
      'Mar',
    ]);
  });

  test('of a simulated clock count from its beginning, without any date', () => {
    expect(timeTicks({ from: 3_500, to: 7_300 }, 4, true)).toEqual([
      { at: 3_600, text: '1:00' },
      { at: 5_400, text: '1:30' },
      { at: 7_200, text: '2:00' },
    ]);
    expect(timeTicks({ from: 61, to: 70 }, 5, true).map(({ text }) => text)).toEqual([
      '0:01:02',
      '0:01:04',
      '0:01:06',
      '0:01:08',
      '0:01:10',
    ]);
  });
});
