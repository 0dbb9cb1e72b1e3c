import { describe, expect, test } from 'vitest';

import { ageSeconds, freshness } from './time';

describe('age', () => {
  test('is the time since the observation', () => {
    expect(ageSeconds(-3_000, 3_500)).toBe(6.5);
  });

  test('is never negative', () => {
    expect(ageSeconds(1_000, 900)).toBe(0);
  });

  test('a tag that nobody observed has none', () => {
    expect(ageSeconds(null, 1_000)).toBeNull();
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
