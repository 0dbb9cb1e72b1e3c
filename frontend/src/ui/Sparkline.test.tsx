import { expect, test } from 'vitest';

import { sparkLines } from './Sparkline';

const value = (sec: number, reading: number | null): Parameters<typeof sparkLines>[0][number] => ({
  stamp: { sec, nanosec: 0 },
  value: reading,
});

test('time runs to the right by its true distances, values upwards', () => {
  const [line] = sparkLines([value(0, 1), value(1, 3), value(10, 2)]);
  const [a, b, c] = line ?? [];
  if (!a || !b || !c) throw new Error('three points expected');
  expect((b.x - a.x) / (c.x - a.x)).toBeCloseTo(0.1);
  expect(b.y).toBeLessThan(c.y);
  expect(c.y).toBeLessThan(a.y);
});

test('a reading that is no number leaves a gap', () => {
  expect(sparkLines([value(0, 1), value(1, null), value(2, 2), value(3, 2)])).toHaveLength(2);
});

test('a clock that stood still spreads the scans evenly', () => {
  const [line] = sparkLines([value(5, 1), value(5, 2), value(5, 3)]);
  const xs = (line ?? []).map(({ x }) => x);
  expect((xs[1] ?? 0) - (xs[0] ?? 0)).toBeCloseTo((xs[2] ?? 0) - (xs[1] ?? 0));
});

test('a constant is a line in the middle', () => {
  const [line] = sparkLines([value(0, 4), value(1, 4)]);
  expect(new Set((line ?? []).map(({ y }) => y)).size).toBe(1);
});
