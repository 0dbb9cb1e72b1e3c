import { expect, test, vi } from 'vitest';

import type { Verdict } from '../contract/types';
import { alarm } from '../testing/alarms';
import { held, reason } from '../testing/health';
import { S } from '../strings';
import { CATALOGUE, IN_FAHRENHEIT } from '../testing/sensors';
import {
  alarmText,
  lengthOf,
  nameText,
  resolvedText,
  spanText,
  sinceText,
  unknownText,
  valuesOf,
  whenText,
  type Now,
} from './words';

const C = CATALOGUE;
const F = IN_FAHRENHEIT;

/** Noon in the browser's time zone, ROS seconds. */
const NOON = new Date(2026, 10, 14, 12).getTime() / 1000;

const known = (value: number | null, verdict: Verdict): Now => ({
  kind: 'known',
  value,
  verdict,
  reason: null,
  trend: null,
});
const CRITICAL = known(6.6, 'critical');

test('what and where, of a tag and of the greenhouse', () => {
  const cold = alarm('a', { tag_id: '5' });
  expect(nameText(cold, C)).toBe('Tag 5: Temperature below 10.0\u00a0°C');
  expect(alarmText(cold, C, CRITICAL)).toBe(
    'Tag 5: Temperature below 10.0\u00a0°C, now 6.6\u00a0°C (critical)',
  );
  expect(alarmText(cold, F, CRITICAL)).toContain('below 50.0\u00a0°F, now 43.9\u00a0°F');
  const silent = alarm('a', { tag_id: '', reason: { kind: 'silent', sensor: '', value: null } });
  expect(alarmText(silent, C, null)).toMatch(/^Whole greenhouse: No current data from the twin/);
});

test('now, at worst and at first, each with its own severity', () => {
  const cold = alarm('a', { tag_id: '9', worst: 8.7, reason: { value: 12.2, limit: 18 } });
  expect(valuesOf(cold, C, known(12.6, 'stressed'))).toMatchObject({
    what: 'Temperature below 18.0\u00a0°C',
    now: 'now 12.6\u00a0°C',
    worst: 'worst 8.7\u00a0°C',
    first: '12.2\u00a0°C when raised',
  });
  expect(alarmText(cold, C, known(12.6, 'stressed'))).toBe(
    'Tag 9: Temperature below 18.0\u00a0°C, now 12.6\u00a0°C, worst 8.7\u00a0°C (critical)',
  );
  expect(alarmText(cold, C, known(18.5, 'healthy'))).toContain('now 18.5\u00a0°C (in range)');
  expect(alarmText(cold, C, known(8.7, 'critical'))).not.toContain('worst');
});

test('its limit is that of now: what is critical; on the way back it stands beside what ends it', () => {
  const cold = alarm('a', { tag_id: '9', worst: 8.7, reason: { value: 17.9, limit: 18 } });
  const at = (value: number, limit: number, verdict: Verdict, release?: number): Now => ({
    ...{ kind: 'known', value, verdict, trend: null },
    reason: reason({ value, limit, verdict, ...held(release) }),
  });
  expect(valuesOf(cold, C, at(8.7, 10, 'critical'))).toMatchObject({
    what: 'Temperature below 10.0\u00a0°C',
    todo: 'Heat, or close the vents',
  });
  expect(valuesOf(cold, C, at(18.02, 18, 'stressed', 18.5))).toMatchObject({
    what: 'Temperature not yet above 18.5\u00a0°C',
    todo: 'Keep an eye on it',
    now: 'now 18.0\u00a0°C',
    first: '17.9\u00a0°C when raised',
  });
});

test('the worst value is told where that of now is better, which may come first', () => {
  const cold = alarm('a', { worst: 8.7, reason: { value: 9, limit: 10 } });
  expect(valuesOf(cold, C, known(8.7, 'critical')).worst).toBeNull();
  expect(valuesOf(cold, C, known(8.2, 'critical')).worst).toBeNull();
  expect(alarmText(cold, C, known(8.2, 'critical'))).not.toContain('worst');
  const humid = { sensor: 'humidity', value: 68, limit: 60 } as const;
  const damp = alarm('b', { worst: 72.9, reason: humid });
  expect(valuesOf(damp, C, known(72.88, 'stressed')).worst, 'reads the same').toBeNull();
  expect(valuesOf(damp, C, known(59, 'healthy')).worst).toBe('worst 72.9\u00a0%');
  const unknown = { kind: 'unknown', last: 80, lastAt: 'unknown' } as const;
  expect(valuesOf(damp, C, unknown).worst).toBe('worst 72.9\u00a0%');
});

test('a worst value is named by the side of its limit that it lies on', () => {
  const lowest = vi.spyOn(S.alarmWorst, 'below');
  const highest = vi.spyOn(S.alarmWorst, 'above');
  valuesOf(alarm('a', { worst: 2.5, reason: { value: 8, limit: 10 } }), C, null);
  valuesOf(alarm('b', { worst: 31, reason: { value: 27, limit: 26 } }), C, null);
  expect(lowest.mock.calls).toEqual([['2.5\u00a0°C']]);
  expect(highest.mock.calls).toEqual([['31.0\u00a0°C']]);
});

test('no value reads like the limit that it differs from', () => {
  const dry = alarm('a', { worst: 44, reason: { sensor: 'humidity', value: 49.96, limit: 50 } });
  expect(valuesOf(dry, C, known(50.02, 'healthy'))).toMatchObject({
    what: 'Humidity below 50.0\u00a0%',
    now: 'now just above 50.0\u00a0%',
    worst: 'worst 44.0\u00a0%',
    first: 'just below 50.0\u00a0% when raised',
  });
});

test('what is not known now says so, with what was known last', () => {
  const cold = alarm('a', { worst: 2.5 });
  const unknown = (last: number | null): Extract<Now, { kind: 'unknown' }> => ({
    kind: 'unknown',
    last,
    lastAt: 'unknown',
  });
  expect(unknownText(cold, C, unknown(7.4), 2_520)).toBe(
    'now unknown, last 7.4\u00a0°C 42\u00a0min ago',
  );
  expect(unknownText(cold, C, unknown(null), null)).toBe('now unknown');
  expect(alarmText(cold, C, unknown(7.4))).toBe(
    'Tag 1: Temperature below 10.0\u00a0°C, worst 2.5\u00a0°C (critical)',
  );
});

test('of a pest how many: now, at worst and at first', () => {
  const reason = { kind: 'pest', sensor: '', value: 2, limit: null } as const;
  const pest = alarm('a', { worst: 4, reason });
  const texts = { what: 'Pest seen', worst: 'peak 4', first: '2 when raised' };
  expect(valuesOf(pest, C, known(3, 'critical'))).toMatchObject({ ...texts, now: 'now 3 pests' });
  expect(valuesOf(pest, C, known(0, 'critical')).now).toBe('still seen');
  expect(valuesOf(pest, C, known(null, 'healthy')).now).toBe('no longer seen');
  // A derived value without a reason.
  const dry = alarm('b', { reason: { sensor: 'vpd', value: 1.7, limit: 1.3 } });
  expect(valuesOf(dry, C, known(null, 'healthy')).now).toBe('now in range');
  // Pest seen, but not counted.
  expect(valuesOf(alarm('a', { worst: 0, reason }), C, known(0, 'stressed')).worst).toBeNull();
});

test('since when and until when: of today the time alone, to the minute', () => {
  const since = alarm('a', { raised: NOON });
  expect(spanText(since, NOON + 1_500, null)).toBe('since 12:00 (25\u00a0min)');
  const over = alarm('a', { raised: NOON, cleared: NOON + 600 });
  expect(spanText(over, NOON + 1_500, null)).toBe('12:00 until 12:10 (10\u00a0min)');
  expect(spanText(over, NOON + 86_400, null)).toBe('14 Nov, 12:00 until 12:10 (10\u00a0min)');
  const night = alarm('a', { raised: NOON, cleared: NOON + 50_000 });
  expect(spanText(night, NOON + 50_001, null)).toMatch(/^14 Nov, 12:00 until 01:53 \(13/);
  expect(whenText(100, 200)).toBe('sim 00:01:40');
});

test('what the log does not reach back to has lasted for longer than is known', () => {
  const at = (sec: number): number => NOON + sec;
  const old = alarm('a', { raised: NOON + 900, reason: { since: at(0) } });
  const text = (known: number, each = old) => spanText(each, NOON + 1_500, at(known));
  expect(text(-899)).toBe('for over 10\u00a0min');
  expect(text(-900), 'an earlier scan was good').toBe('since 12:15 (10\u00a0min)');
  const pest = { kind: 'pest', since: at(900) } as const;
  expect(text(900, alarm('b', { raised: NOON + 900, reason: pest }))).toMatch(/^since/);
});

test('since when; for how long only if it began today, in hours from ten on', () => {
  const since = alarm('a', { raised: NOON });
  const text = (nowS: number | null): string => spanText(since, nowS, null);
  expect(text(NOON + 7_500)).toBe('since 12:00 (2\u00a0h\u00a05\u00a0min)');
  expect(text(NOON + 39_500)).toBe('since 12:00 (10\u00a0h)');
  expect(sinceText(since, NOON + 7_500, null)).toBe('since 12:00');
  expect(text(NOON + 86_400)).toBe('since 14 Nov, 12:00');
  expect(text(null)).toBe('since 14 Nov, 12:00');
  // The clock was set back since.
  expect(text(NOON - 60)).toBe('since 12:00');
  // A simulated clock has no days.
  expect(spanText(alarm('a', { raised: 100 }), 160, null)).toMatch(/^since sim .* \(1\u00a0min\)$/);
  const over = alarm('a', { raised: NOON, cleared: NOON + 600 });
  expect(lengthOf(over, NOON + 1_500, null)).toBe('10\u00a0min');
  expect(resolvedText(over, NOON + 1_500)).toBe('resolved 12:10');
});
