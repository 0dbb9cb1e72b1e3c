import { expect, test } from 'vitest';

import { alarm } from '../testing/alarms';
import { S } from '../strings';
import { CATALOGUE } from '../testing/sensors';
import { alarmText, severalText, spanText, whatText, whenText, worstText } from './words';

const C = { sensors: CATALOGUE, unit: 'C' } as const;
const F = { ...C, unit: 'F' } as const;

/** Noon on the operator's own clock, ROS seconds. */
const NOON = new Date(2026, 10, 14, 12).getTime() / 1000;

test('what and where, of a tag and of the house', () => {
  expect(alarmText(alarm('a', { tag_id: '5' }), C)).toBe(
    'Tag 5: Temperature 6.6\u00a0°C, below 10.0 (critical)',
  );
  expect(alarmText(alarm('a', { tag_id: '5' }), F)).toContain('43.9\u00a0°F, below 50.0');
  const silent = alarm('a', { tag_id: '', reason: { kind: 'silent', sensor: '', value: null } });
  expect(alarmText(silent, C)).toMatch(/^Whole house: The twin is silent/);
});

test('how bad at worst, with its unit, unless it was never worse', () => {
  expect(worstText(alarm('a', { worst: 2.5 }), C)).toBe('at worst 2.5\u00a0°C (critical)');
  expect(worstText(alarm('a', { worst: 2.5 }), F)).toBe('at worst 36.5\u00a0°F (critical)');
  expect(worstText(alarm('a', { worst: 6.6 }), C)).toBeNull();
  expect(worstText(alarm('a'), C)).toBeNull();
  const pest = { kind: 'pest', sensor: '', value: 2, limit: null } as const;
  expect(worstText(alarm('a', { worst: 4, reason: pest }), C)).toBe('at worst 4 pests seen');
  expect(worstText(alarm('a', { worst: 2, reason: pest }), C)).toBeNull();
});

test('the verdict is that of the worst value: a milder one before it is not called critical', () => {
  // Raised at 12.2 °C, below the ideal; later 8.7 °C, below what is critical.
  const cold = { value: 12.2, limit: 18 };
  const worse = alarm('a', { tag_id: '9', worst: 8.7, reason: cold });
  expect(whatText(worse, C)).toBe('Temperature 12.2\u00a0°C, below 18.0');
  expect(worstText(worse, C)).toBe('at worst 8.7\u00a0°C (critical)');
  expect(alarmText(worse, C)).toBe(
    'Tag 9: Temperature 12.2\u00a0°C, below 18.0, at worst 8.7\u00a0°C (critical)',
  );
  const stressed = alarm('a', { worst: 11.9, reason: { ...cold, verdict: 'stressed' } });
  expect(worstText(stressed, C)).toBe('at worst 11.9\u00a0°C');
});

test('since when and until when: of today the time alone', () => {
  const since = alarm('a', { raised: NOON });
  expect(spanText(since, NOON + 1_500)).toBe('since 12:00:00 (25\u00a0min)');
  expect(spanText(since, NOON + 86_400)).toBe('since 14 Nov 2026, 12:00:00 (1\u00a0d 0\u00a0h)');
  expect(spanText(since, null)).toBe('since 14 Nov 2026, 12:00:00');
  const over = alarm('a', { raised: NOON, cleared: NOON + 600 });
  expect(spanText(over, NOON + 1_500)).toBe('12:00:00 until 12:10:00 (10\u00a0min)');
  expect(spanText(over, NOON + 86_400)).toBe('14 Nov 2026, 12:00:00 until 12:10:00 (10\u00a0min)');
  const night = alarm('a', { raised: NOON, cleared: NOON + 50_000 });
  expect(spanText(night, NOON + 50_001)).toMatch(/^14 Nov 2026, 12:00:00 until 01:53:20 \(13/);
  expect(whenText(100, 200)).toBe('sim 00:01:40');
});

test('of several the first are named', () => {
  const four = ['1', '2', '3', '4'].map((tag_id) => alarm(tag_id, { tag_id }));
  expect(severalText(four.slice(0, 1), C, S.alarmsRaised)).toMatch(/^New: Tag 1: [^;]*critical\)$/);
  expect(severalText(four, C, S.alarmsRaised)).toMatch(/Tag 3: [^;]* and 1 more$/);
});
