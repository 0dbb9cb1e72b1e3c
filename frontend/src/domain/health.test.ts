import { describe, expect, test } from 'vitest';

import { judgement, NOBODY, reason } from '../testing/health';
import { tag } from '../testing/tags';
import {
  houseHealth,
  rangeReason,
  severity,
  sharedJudgement,
  sideOf,
  type HouseHealth,
} from './health';

const house = (said: Parameters<typeof judgement>[0], isHeard = true): HouseHealth =>
  houseHealth(
    Object.keys(said).map((tag_id) => tag({ tag_id })),
    judgement(said),
    isHeard,
  );

describe('house', () => {
  const mixed = {
    1: 'healthy',
    2: [reason({ verdict: 'critical' })],
    3: [reason(), reason({ sensor: 'humidity' })],
    4: 'unknown',
  } as const;

  test('is what the bridge says, tag by tag and as a whole', () => {
    const { verdict, worst, counts, byTag } = house(mixed);
    expect(verdict).toBe('critical');
    expect(worst?.tagId).toBe('3');
    expect(counts).toEqual({ critical: 2, stressed: 0, unknown: 1, healthy: 1 });
    expect(byTag.get('4')).toEqual({ verdict: 'unknown', reasons: [] });
  });

  test('nothing that is read makes a verdict: only what is said does', () => {
    const lethal = tag({ readings: [{ name: 'temperature', value: -40 }] as never });
    expect(houseHealth([lethal], judgement({ 1: 'healthy' }), true).verdict).toBe('healthy');
    expect(houseHealth([lethal], null, true).verdict).toBe('unknown');
  });

  test('that is not heard of is unknown and says why; of its tags stands what was said', () => {
    const silent = house(mixed, false);
    expect(silent).toMatchObject({ verdict: 'unknown', worst: null });
    expect(silent.reasons.map(({ kind }) => kind)).toEqual(['silent']);
    expect(silent.counts.critical).toBe(2);
  });

  test('a tag that was not judged yet is unknown', () => {
    expect(houseHealth([tag()], NOBODY, true).byTag.get('1')?.verdict).toBe('unknown');
  });

  test('of equals the first makes it what it is; of one that is well nobody does', () => {
    expect(house({ 1: [reason()], 2: [reason()] }).worst?.tagId).toBe('1');
    expect(house({ 1: 'healthy' }).worst).toBeNull();
  });
});

test('the worst verdict is the most severe, and of one verdict who has most reasons for it', () => {
  const order = [
    { verdict: 'critical', reasons: Array.from({ length: 50 }, () => reason()) },
    { verdict: 'critical', reasons: [reason(), reason()] },
    { verdict: 'critical', reasons: [reason(), reason({ verdict: 'stressed' })] },
    { verdict: 'stressed', reasons: [reason({ verdict: 'stressed' })] },
    { verdict: 'unknown', reasons: [] },
    { verdict: 'healthy', reasons: [] },
  ] as const;
  const severities = order.map(severity);
  expect(severities).toEqual([...severities].sort((a, b) => b - a));
  expect(new Set(severities).size).toBe(order.length);
});

test('a value is out of its range where a reason says so', () => {
  const health = { verdict: 'critical', reasons: [reason(), reason({ kind: 'old' })] } as const;
  const found = rangeReason(health, 'temperature');
  expect(found && sideOf(found)).toBe('below');
  expect(sideOf({ value: 11, limit: 10 })).toBe('above');
  expect(rangeReason(health, 'humidity')).toBeNull();
  expect(rangeReason(undefined, 'temperature')).toBeNull();
});

test('what is said again is the very same', () => {
  const before = judgement({ 1: 'healthy' });
  expect(sharedJudgement(before, { ...before, house: { ...before.house } })).toBe(before);
  const night = { is_day: false, source: 'light' } as const;
  const now = { ...before, house: { ...before.house, day: night } };
  expect(sharedJudgement(before, now)).toBe(now);
  expect(sharedJudgement(null, now)).toBe(now);
});

test('what was not judged is unknown, and that is no silence of the twin', () => {
  expect(houseHealth([], null, true)).toMatchObject({ verdict: 'unknown', reasons: [] });
  expect(houseHealth([], null, false).reasons.map(({ kind }) => kind)).toEqual(['silent']);
});
