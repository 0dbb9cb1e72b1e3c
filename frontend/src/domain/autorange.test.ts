import { expect, test } from 'vitest';

import { heldRange, rounded, withIdeal } from './autorange';
import type { Range } from './ramp';

const run = (values: readonly (readonly [number, number])[]): Range[] => {
  let held: Range | null = null;
  return values.map(([low, high]) => (held = heldRange(held, { low, high })));
};

test('is rounded outwards', () => {
  expect(rounded({ low: 20.34, high: 31.2 })).toEqual({ low: 20, high: 32 });
  expect(rounded({ low: 7, high: 7 })).toEqual({ low: 7, high: 7 });
});

test('values that come and go at its edge do not make it flicker', () => {
  const ranges = run([
    [20.2, 29.8],
    ...Array.from({ length: 50 }, (_, n) => [20.2, 29.8 + 0.4 * (n % 2)] as const),
  ]);
  // Once wider for what came, and never back and forth after it.
  expect(new Set(ranges).size).toBe(2);
  expect(ranges.at(-1)).toEqual({ low: 20, high: 31 });
});

test('it widens at once, and narrows only when much of it lies idle', () => {
  const [, wide, still, narrow] = run([
    [20, 30],
    [20, 40],
    [20, 34.1],
    [20, 33.9],
  ]);
  expect(wide).toEqual({ low: 20, high: 40 });
  expect(still).toBe(wide);
  expect(narrow).toEqual({ low: 20, high: 34 });
});

test('no value is ever outside of it', () => {
  let held: Range | null = null;
  for (let n = 0; n < 500; n++) {
    const data = { low: 20 + 9 * Math.sin(n * 1.7), high: 30 + 8 * Math.cos(n * 0.9) };
    if (data.low > data.high) continue;
    held = heldRange(held, data);
    expect(held.low).toBeLessThanOrEqual(data.low);
    expect(held.high).toBeGreaterThanOrEqual(data.high);
  }
});

test('an ideal house is in the middle of its colours, and its noise moves nothing', () => {
  expect(withIdeal({ low: 21.8, high: 22.2 }, [18, 26])).toEqual({ low: 18, high: 26 });
  expect(withIdeal({ low: 21.8, high: 31 }, [18, 26])).toEqual({ low: 18, high: 31 });
  expect(withIdeal({ low: 21.8, high: 31 }, null)).toEqual({ low: 21.8, high: 31 });
});
