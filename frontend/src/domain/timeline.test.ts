import { expect, test } from 'vitest';

import { wireStretch, wireTime, wireTimeline } from '../testing/timeline';
import { missingOf, timelineOf } from './timeline';

test('a timeline has its times in seconds', () => {
  const wire = wireTimeline({
    from: 100,
    to: 340,
    reach: wireStretch(20, 340.5),
    buckets: [
      {
        start: wireTime(101.5),
        scans: 5,
        failures: 1,
        looks: 2,
        pests_seen: 3,
        pests_cleared: 4,
      },
    ],
    silences: [wireStretch(110, 120)],
    runs: [{ ...wireStretch(20, 340), is_simulated: true }],
  });
  expect(timelineOf({ ...wire, kept_from: wireTime(105) }, 400)).toEqual({
    from: 100,
    to: 340,
    bucketS: 1,
    reach: { from: 20, to: 340.5 },
    buckets: [{ start: 101.5, scans: 5, failures: 1, looks: 2, pestsSeen: 3, pestsCleared: 4 }],
    silences: [{ from: 110, to: 120 }],
    runs: [{ from: 20, to: 340, isSimulated: true }],
    missing: [{ from: 100, to: 105, why: 'not_kept' }],
  });
  expect(timelineOf({ ...wire, reach: null }, 400).reach).toBeNull();
});

const told = (
  keptFrom: number | null,
  completeTo: number | null,
): Parameters<typeof missingOf>[0] => ({
  from: wireTime(100),
  to: wireTime(200),
  kept_from: keptFrom === null ? null : wireTime(keptFrom),
  complete_to: completeTo === null ? null : wireTime(completeTo),
});

test('what is kept and complete, or of which nobody knows, misses nothing', () => {
  expect(missingOf(told(100, 200), 300)).toEqual([]);
  expect(missingOf(told(null, null), 300)).toEqual([]);
});

test('before what is kept, and behind what is complete, something is missing', () => {
  expect(missingOf(told(120, 160), 300)).toEqual([
    { from: 100, to: 120, why: 'not_kept' },
    { from: 160, to: 200, why: 'not_recorded' },
  ]);
});

test('what has not come yet is not missing, nor what is about to be written', () => {
  expect(missingOf(told(100, 150), 155)).toEqual([]);
  expect(missingOf(told(100, 150), 156)).toEqual([{ from: 150, to: 156, why: 'not_recorded' }]);
});
