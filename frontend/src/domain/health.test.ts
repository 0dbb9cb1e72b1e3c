import { describe, expect, test } from 'vitest';

import { held, judgement, NOBODY, reason } from '../testing/health';
import { tag } from '../testing/tags';
import {
  houseHealth,
  rangeReason,
  severity,
  sharedJudgement,
  sideOf,
  worstReason,
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
    const { verdict, counts, byTag } = house(mixed);
    expect(verdict).toBe('critical');
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
    expect(silent).toMatchObject({ verdict: 'unknown' });
    expect(silent.reasons.map(({ kind }) => kind)).toEqual(['silent']);
    expect(silent.counts.critical).toBe(2);
  });

  test('a tag that was not judged yet is unknown', () => {
    expect(houseHealth([tag()], NOBODY, true).byTag.get('1')?.verdict).toBe('unknown');
  });
});

test('the worst verdict is the most severe, and of one verdict who is farthest beyond a limit', () => {
  const pest = { kind: 'pest', sensor: '', limit: null } as const;
  const mild = { verdict: 'stressed', limit: 20 } as const;
  const order = [
    { verdict: 'critical', reasons: [reason({ value: -90, limit: 10 })] },
    { verdict: 'critical', reasons: [reason({ ...pest, value: 7 })] },
    { verdict: 'critical', reasons: [reason({ ...pest, value: 1 })] },
    {
      verdict: 'critical',
      reasons: [reason({ value: 9, limit: 10 }), reason({ value: 6, limit: 10 })],
    },
    {
      verdict: 'critical',
      reasons: [reason({ value: 9, limit: 10 }), reason({ ...mild, value: 5 })],
    },
    { verdict: 'stressed', reasons: [reason({ ...mild, value: 25 })] },
    { verdict: 'stressed', reasons: [reason({ ...mild, value: 19 })] },
    { verdict: 'stressed', reasons: [reason({ ...mild, value: 20 })] },
    { verdict: 'unknown', reasons: [] },
    { verdict: 'healthy', reasons: [] },
  ] as const;
  const severities = order.map((each) => severity(each));
  expect(severities).toEqual([...severities].sort((a, b) => b - a));
  expect(new Set(severities).size).toBe(order.length);
  expect(worstReason(order[3])?.value).toBe(6);
  expect(worstReason(order[4])?.value).toBe(9);
});

test('what is beyond its limit is worse than what only the deadband still holds', () => {
  const beyond = reason({ value: 9.9, limit: 10 });
  const back = reason({ value: 26, limit: 30, ...held(25.6) });
  expect(worstReason({ verdict: 'critical', reasons: [back, beyond] })).toBe(beyond);
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
