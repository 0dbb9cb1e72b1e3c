import { describe, expect, test } from 'vitest';

import type { DeltaFrame } from '../contract/types';
import { NOBODY } from '../testing/health';
import { stateFrame, wireTag } from '../testing/tags';
import { latestAfter } from '../contract/frames';

const a = wireTag({
  tag_id: 'a',
  last_observed: { sec: 995, nanosec: 0 },
  readings: [
    // Flowers were looked at since.
    { name: 'co2', value: 600, observed_at: { sec: 100, nanosec: 0 }, stale_seconds: 900 },
    // A twin that does not tell.
    { name: 'light', value: 9, observed_at: null, stale_seconds: null },
  ],
});
const b = wireTag({ tag_id: 'b', stale_seconds: null, last_observed: { sec: 0, nanosec: 0 } });
const full = stateFrame([a, b], { seq: 7, sec: 1000 });

const delta = (over: Partial<DeltaFrame> = {}): DeltaFrame => ({
  type: 'delta',
  seq: 8,
  base: 7,
  revision: 'r2',
  header: { stamp: { sec: 1002, nanosec: 500_000_000 }, frame_id: 'map' },
  changed: [],
  removed: [],
  health: NOBODY,
  ...over,
});

describe('the newest state', () => {
  test('a full frame stands for itself, whatever was before', () => {
    expect(latestAfter(null, full)).toBe(full);
    expect(latestAfter({ ...full, seq: 900 }, full)).toBe(full);
  });

  test('changed tags take their place, new ones come behind, removed ones go', () => {
    const changed = [wireTag({ tag_id: 'b', species: 'rose' }), wireTag({ tag_id: 'c' })];
    const after = latestAfter(full, delta({ changed, removed: ['a'] }));
    expect(after?.state.tags).toEqual(changed);
    expect(after).toMatchObject({ seq: 8, revision: 'r2' });
  });

  test('an unchanged tag grows older by the twin’s clock and shares the rest', () => {
    const after = latestAfter(full, delta());
    const [first, second] = a.readings;
    expect(after?.state.tags[0]).toEqual({
      ...a,
      stale_seconds: 7.5,
      readings: [{ ...first, stale_seconds: 902.5 }, second],
    });
    expect(after?.state.tags[0]?.pose).toBe(a.pose);
    expect(after?.state.tags[1]?.stale_seconds).toBeNull();
  });

  test('a clock that jumped back makes no negative age', () => {
    const header = { stamp: { sec: 3, nanosec: 0 }, frame_id: 'map' };
    expect(latestAfter(full, delta({ header }))?.state.tags[0]?.stale_seconds).toBe(0);
  });

  test('a delta on another frame, or on none, cannot be used', () => {
    expect(latestAfter(full, delta({ base: 6 }))).toBeNull();
    expect(latestAfter(null, delta())).toBeNull();
  });
});

test('the health of who has changed is another, and of who is gone none', () => {
  const critical = { verdict: 'critical', reasons: [] } as const;
  const healthy = { verdict: 'healthy', reasons: [] } as const;
  const known = { ...full, health: { ...NOBODY, tags: { a: healthy, b: critical } } };
  const same = latestAfter(known, delta());
  expect(same?.health.tags).toBe(known.health.tags);
  const house = { ...NOBODY.house, verdict: 'critical' } as const;
  const then = latestAfter(
    known,
    delta({ removed: ['b'], health: { house, tags: { a: critical } } }),
  );
  expect(then?.health).toEqual({ house, tags: { a: critical } });
});
