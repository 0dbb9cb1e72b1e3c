import { expect, test } from 'vitest';

import { wireStretch, wireTime, wireTimeline } from '../testing/timeline';
import { timelineOf } from './timeline';

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
