import { describe, expect, test } from 'vitest';

import type { HealthReason } from '../contract/types';
import { S } from '../strings';
import { held, judgement, NOBODY, reason } from '../testing/health';
import { CATALOGUE, IN_FAHRENHEIT } from '../testing/sensors';
import { readings, tag } from '../testing/tags';
import {
  causeText,
  houseHealth,
  type HouseHealth,
  rangeReason,
  reasonsText,
  reasonText,
  severity,
  sharedJudgement,
  sideOf,
  todoText,
  worstReason,
} from './health';

const house = (said: Parameters<typeof judgement>[0], isReceiving = true): HouseHealth =>
  houseHealth(
    Object.keys(said).map((tag_id) => tag({ tag_id })),
    judgement(said),
    isReceiving,
  );

describe('house', () => {
  const mixed = {
    1: 'healthy',
    2: [reason({ verdict: 'critical' })],
    3: [reason(), reason({ sensor: 'humidity' })],
    4: 'unknown',
  } as const;

  test('is as judged by the bridge, for each tag and as a whole', () => {
    const { verdict, counts, byTag } = house(mixed);
    expect(verdict).toBe('critical');
    expect(counts).toEqual({ critical: 2, stressed: 0, unknown: 1, healthy: 1 });
    expect(byTag.get('4')).toEqual({ verdict: 'unknown', reasons: [] });
  });

  test('readings make no verdict: the bridge’s judgement does', () => {
    const lethal = tag({ readings: readings({ temperature: -40 }) });
    expect(houseHealth([lethal], judgement({ 1: 'healthy' }), true).verdict).toBe('healthy');
    expect(houseHealth([lethal], null, true).verdict).toBe('unknown');
  });

  test('a silent one is unknown, with the reason; its tags keep their last verdicts', () => {
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

test('a value is out of its range if a reason says so', () => {
  const health = { verdict: 'critical', reasons: [reason(), reason({ kind: 'old' })] } as const;
  const found = rangeReason(health, 'temperature');
  expect(found && sideOf(found)).toBe('below');
  expect(sideOf({ value: 11, limit: 10 })).toBe('above');
  expect(rangeReason(health, 'humidity')).toBeNull();
  expect(rangeReason(undefined, 'temperature')).toBeNull();
});

test('a repeated judgement is the same object', () => {
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

const text = (over: Parameters<typeof reason>[0], age: number | null = null): string =>
  reasonText(CATALOGUE, reason(over), age);
const NBSP = '\u00a0';
const old = { kind: 'old', verdict: 'unknown', sensor: '', value: null } as const;

describe('a reason in words', () => {
  test.each([
    [{}, null, `Temperature 6.6${NBSP}°C, below 10.0 (critical)`],
    [
      { verdict: 'stressed', value: 30, limit: 26 } as const,
      null,
      `Temperature 30.0${NBSP}°C, above 26.0`,
    ],
    [
      { sensor: 'humidity', verdict: 'stressed', value: 49.97, limit: 50 } as const,
      null,
      `Humidity just below 50.0${NBSP}%`,
    ],
    [
      { sensor: 'co2', verdict: 'stressed', value: 1500.4, limit: 1500 } as const,
      null,
      `CO₂ just above 1,500${NBSP}ppm`,
    ],
    [
      { verdict: 'critical', value: 34.99, limit: 35.01 } as const,
      null,
      `Temperature just below 35.0${NBSP}°C (critical)`,
    ],
    [
      // Within the ideal range of 18 to 26, but not far enough.
      { verdict: 'stressed', value: 18.1, limit: 18, ...held(18.4) } as const,
      null,
      `Temperature 18.1${NBSP}°C, not yet above 18.4`,
    ],
    [
      { verdict: 'stressed', value: 26, limit: 26, ...held(25.6) } as const,
      null,
      `Temperature 26.0${NBSP}°C, not yet below 25.6`,
    ],
    [
      // Only just within the critical limit of 10, and far from the ideal range.
      { value: 10.39, limit: 10, ...held(10.4) } as const,
      null,
      `Temperature not yet above 10.4${NBSP}°C (critical)`,
    ],
    [
      { sensor: 'vpd', value: 1.68, limit: 1.3, verdict: 'stressed' } as const,
      null,
      `VPD 1.68${NBSP}kPa, above 1.30`,
    ],
    [
      { kind: 'reading_failed', sensor: 'humidity', value: null } as const,
      60,
      'Humidity: the sensor returns no value',
    ],
    [
      { kind: 'scan_failed', sensor: '', value: 1, limit: null } as const,
      180,
      `Last scan failed: not reachable, 3${NBSP}min ago`,
    ],
    [
      { kind: 'scan_failed', sensor: '', value: 2, limit: null } as const,
      null,
      'Last scan failed: not readable',
    ],
    [{ kind: 'pest', sensor: '', value: 3, limit: null } as const, 5, '3 pests seen'],
    [{ kind: 'pest', sensor: '', value: 0, limit: null } as const, 5, 'Pest seen'],
    [
      { kind: 'pest', sensor: '', value: 3, limit: null } as const,
      9 * 86_400,
      `3 pests seen (9${NBSP}d ago)`,
    ],
    [
      { ...old, limit: 1_800 },
      345_600,
      `Not scanned for 4${NBSP}d (readings are valid for 30${NBSP}min)`,
    ],
    [
      { ...old, limit: 86_400, sensor: 'soil_moisture' },
      90_000,
      `Soil moisture: no reading for 1${NBSP}d 1${NBSP}h (readings are valid for 1${NBSP}d)`,
    ],
    [{ ...old, limit: 600 }, null, `Not scanned recently (readings are valid for 10${NBSP}min)`],
    [{ ...old, limit: 5_400, since: null }, null, 'No reading yet'],
    [
      { kind: 'changed', value: 22, limit: null } as const,
      null,
      `Temperature 22.0${NBSP}°C: possible sensor fault`,
    ],
    [
      { kind: 'silent', sensor: '', value: null, limit: null } as const,
      null,
      'No current data from the twin',
    ],
    [
      { kind: 'stopped', sensor: '', value: null, limit: null } as const,
      null,
      'No tag is being scanned: the robot has stopped, or its data is lost',
    ],
    [{ kind: 'door_open' as never, sensor: '', value: null, limit: null }, null, 'door open'],
  ] as const)('%o', (over, age, expected) => {
    expect(text(over, age)).toBe(expected);
  });

  test('follows the unit that is chosen', () => {
    expect(reasonText(IN_FAHRENHEIT, reason(), null)).toBe(
      `Temperature 43.9${NBSP}°F, below 50.0 (critical)`,
    );
  });

  test('back in its ideal range, it is watched; within what is critical alone, it is not enough', () => {
    expect(todoText(reason({ verdict: 'stressed', value: 18.1, limit: 18, ...held(18.4) }))).toBe(
      'Keep an eye on it',
    );
    expect(todoText(reason({ value: 10.1, limit: 10, ...held(10.4) }))).toMatch(/^Heat/);
  });

  test('beside its mark, it does not say again how bad it is', () => {
    expect(reasonText(CATALOGUE, reason(), null, true)).toBe(
      `Temperature 6.6${NBSP}°C, below 10.0`,
    );
  });

  test('beside the value, it does not say that again, unless it reads like its limit', () => {
    const beside = ['temperature', 'humidity'];
    const said = (over: Partial<HealthReason>): string =>
      causeText(CATALOGUE, [reason(over)], null, true, beside);
    expect(said({})).toBe('Temperature below 10.0');
    expect(said({ sensor: 'co2', value: 300, limit: 350 })).toBe(`CO₂ 300${NBSP}ppm, below 350`);
    expect(said({ value: 9.99 })).toBe(`Temperature just below 10.0${NBSP}°C`);
    const damp = [
      reason({ sensor: 'humidity', value: 97, limit: 85 }),
      reason({ sensor: 'vpd', value: 0.11, limit: 0.2 }),
    ];
    expect(causeText(CATALOGUE, damp, null, true, beside)).toBe(`Air too damp: VPD 0.11${NBSP}kPa`);
    expect(causeText(CATALOGUE, damp, null, true, ['humidity', 'vpd'])).toBe('Air too damp');
  });

  test('a healthy value waits for a scan; pests, for another inspection', () => {
    const well = { verdict: 'healthy' } as const;
    expect(todoText(reason(well))).toBe(S.todoWell);
    expect(todoText(reason({ ...well, kind: 'pest', value: 0 }))).toBe(S.todoPestAgain);
  });

  test('of a name that some twin made up stays short', () => {
    expect(text({ sensor: '\u202e' + 'x'.repeat(500) }).length).toBeLessThan(80);
  });
});

test('all of them are one line, the worst first', () => {
  const pest = reason({ kind: 'pest', sensor: '', value: 1, limit: null });
  expect(reasonsText(CATALOGUE, [reason(), pest])).toBe(
    `Temperature 6.6${NBSP}°C, below 10.0 (critical); 1 pest seen`,
  );
  expect(reasonsText(CATALOGUE, [])).toBe('');
});
