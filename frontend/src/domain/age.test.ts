import { describe, expect, test } from 'vitest';

import { ageSeconds, freshness } from './age';

describe('age', () => {
  test('is the age in the snapshot plus the time since', () => {
    expect(ageSeconds(4, 1_000, 3_500)).toBe(6.5);
  });

  test('never runs backwards', () => {
    expect(ageSeconds(4, 1_000, 900)).toBe(4);
  });

  test('a tag that nobody observed has none', () => {
    expect(ageSeconds(null, 0, 1_000)).toBeNull();
  });
});

describe('freshness', () => {
  test('is full for a minute, then falls, and never to nothing', () => {
    expect(freshness(0)).toBe(1);
    expect(freshness(60)).toBe(1);
    expect(freshness(300)).toBeLessThan(1);
    expect(freshness(600)).toBeLessThan(freshness(300));
    expect(freshness(1e9)).toBeCloseTo(0.35);
    expect(freshness(null)).toBeCloseTo(0.35);
  });
});
