import { expect, test } from 'vitest';

import type { HealthReason } from '../contract/types';
import type { TagThen } from '../domain/difference';
import { todoText } from '../domain/health';
import { alarm } from '../testing/alarms';
import { reason } from '../testing/health';
import { readings, tag } from '../testing/tags';
import { nowOf, reasonNow } from './words';

const cold = alarm('a', { worst: 4 });
const state = (value: number | null, ...reasons: readonly Partial<HealthReason>[]): TagThen =>
  stateOf({ temperature: value }, ...reasons);
const stateOf = (
  values: Parameters<typeof readings>[0],
  ...reasons: readonly Partial<HealthReason>[]
): TagThen => ({
  tag: tag({ readings: readings(values) }),
  // The code under test reads the verdict only if there are no reasons.
  health: { verdict: reasons.length > 0 ? 'unknown' : 'healthy', reasons: reasons.map(reason) },
});
/** A tag that the bridge did not judge, as without a clock. */
const unjudged: TagThen = { ...state(8), health: { verdict: 'unknown', reasons: [] } };
const old = { kind: 'old', verdict: 'unknown', value: null } as const;

test('the current reading with the current verdict', () => {
  expect(nowOf(cold, state(8, { verdict: 'stressed' }), null, true)).toMatchObject({
    kind: 'known',
    value: 8,
    verdict: 'stressed',
    trend: null,
  });
  expect(nowOf(cold, state(20), null, true)).toMatchObject({ value: 20, verdict: 'healthy' });
});

test('a reading from before the alarm is none of now', () => {
  const later = alarm('a', { raised: 101 });
  expect(nowOf(later, state(20), null, true)).toMatchObject({ kind: 'unknown', last: null });
});

test('its trend is that against an hour before', () => {
  const before = {
    ...state(11),
    tag: tag({
      readings: readings({ temperature: 11 }, 1),
    }),
  };
  expect(nowOf(cold, state(8, {}), before, true)).toMatchObject({ trend: -3 });
  expect(nowOf(cold, state(8, {}), state(8), true)).toMatchObject({ trend: null });
});

test.each([
  ['its reading is too old', state(8, {}, { ...old, sensor: 'temperature' }), true, 8],
  ['all readings are too old', state(8, {}, { ...old, sensor: '' }), true, 8],
  ['the sensor gives none', state(null), true, null],
  ['the twin is silent', state(8, {}), false, 8],
  ['nothing is judged', unjudged, true, 8],
  ['there is no such tag', null, true, null],
] as const)('it is not known where %s', (_, then, isLive, last) => {
  expect(nowOf(cold, then, null, isLive)).toMatchObject({ kind: 'unknown', last });
});

test.each([
  [state(8, { verdict: 'stressed' }), 'stressed'],
  [state(20), 'healthy'],
  [state(8, { verdict: 'stressed' }, { ...old, sensor: '' }), 'stressed'],
  [state(20, { ...old, sensor: 'temperature' }), 'unknown'],
  [unjudged, 'critical'],
] as const)('of a silent twin, or an old reading, it is as bad as last judged', (then, verdict) => {
  const raised = alarm('a', { reason: { verdict: 'critical' } });
  const last = reasonNow(raised, nowOf(raised, then, null, false));
  expect(last.verdict).toBe(verdict);
  if (verdict === 'unknown') expect(todoText(last)).toBe('Check the route of the robot');
  const isOld = then.health.reasons.some(({ kind }) => kind === 'old');
  if (isOld) expect(reasonNow(raised, nowOf(raised, then, null, true))).toEqual(last);
});

test('another sensor’s age does not matter, but of the same scan', () => {
  const others = { ...old, sensor: 'humidity' };
  expect(nowOf(cold, state(8, {}, others), null, true)?.kind).toBe('known');
  const air = stateOf({ temperature: 8, humidity: 60, vpd: 0.9 }, others);
  const dry = alarm('b', { reason: { sensor: 'vpd' } });
  expect(nowOf(dry, air, null, true)).toMatchObject({ kind: 'unknown', last: 0.9 });
  const healthy = stateOf({ vpd: 0.9 });
  expect(nowOf(dry, healthy, null, true)).toMatchObject({ value: 0.9, verdict: 'healthy' });
});

test('of a quantity of a day the value is that of its reason', () => {
  const others = { ...old, sensor: 'humidity' };
  const mean = { sensor: 'temperature_24h_mean', value: 30, limit: 28 };
  const hot = alarm('b', { reason: mean });
  expect(nowOf(hot, state(8, mean), null, true)).toMatchObject({ kind: 'known', value: 30 });
  expect(nowOf(hot, state(8, mean, others), null, true)).toMatchObject({ kind: 'unknown' });
  // In range it has no reason: like its tag, it counts as healthy.
  expect(nowOf(hot, state(8), null, true)).toMatchObject({ value: null, verdict: 'healthy' });
  expect(nowOf(hot, state(8, others), null, true)).toMatchObject({ kind: 'unknown', last: null });
  // If its sensor failed, it has no reason either.
  const failed = { kind: 'reading_failed', verdict: 'stressed', sensor: 'humidity' } as const;
  expect(nowOf(hot, state(8, failed), null, true)).toMatchObject({ kind: 'unknown', last: null });
});

test('the last count of a pest', () => {
  const pest = { kind: 'pest', sensor: '', value: 3, limit: null } as const;
  const seen = alarm('a', { reason: pest });
  const infested = {
    tag: tag({ anomaly: true, bug_count: 3 }),
    health: { verdict: 'critical', reasons: [reason(pest)] },
  } as const;
  expect(nowOf(seen, infested, null, true)).toMatchObject({ value: 3, verdict: 'critical' });
  expect(nowOf(seen, state(8), null, true)).toMatchObject({ value: null, verdict: 'healthy' });
  expect(nowOf(seen, infested, null, false)).toMatchObject({ kind: 'unknown' });
  expect(reasonNow(seen, nowOf(seen, unjudged, null, false)).verdict).toBe('critical');
});

test('what is resolved, or of no value, has none', () => {
  expect(nowOf(alarm('a', { cleared: 950 }), state(8), null, true)).toBeNull();
  expect(nowOf(alarm('a', { reason: { kind: 'old' } }), state(8), null, true)).toBeNull();
  expect(nowOf(alarm('a', { reason: { kind: 'silent' } }), null, null, true)).toBeNull();
});
