import { describe, expect, test } from 'vitest';

import type { Field, HealthReason } from '../contract/types';
import { fieldWith } from '../testing/field';
import { judgement, reason } from '../testing/health';
import { sensorNamed } from '../testing/sensors';
import { readings, tag } from '../testing/tags';
import {
  differenceOf,
  differenceShown,
  differenceText,
  divergingShade,
  symmetricRange,
  type TagThen,
  trendOf,
} from './difference';

const field = (values: readonly number[], over: Partial<Field> = {}): Field =>
  fieldWith([values], { resolution: 0.1, valueMin: 0, valueMax: 0, sampleCount: 3, ...over });

describe('a difference', () => {
  test('is the field that is shown less the other, and not known where either is not', () => {
    const shown = field([20, 21, NaN, 18]);
    const then = field([18.5, 23, 20, NaN], { sampleCount: 2 });
    const between = differenceOf(shown, then);
    expect([...between.values]).toEqual([1.5, -2, NaN, NaN]);
    expect([between.valueMin, between.valueMax, between.sampleCount]).toEqual([-2, 1.5, 2]);
  });

  test('of nothing known is empty, as a field is', () => {
    const between = differenceOf(field([NaN, 1]), field([1, NaN]));
    expect([between.valueMin, between.valueMax, between.sampleCount]).toEqual([0, 0, 0]);
  });

  test.each(['sensor', 'width', 'height', 'originX', 'originY', 'resolution'] as const)(
    'of two with another %s is none',
    (key) => {
      const other = field([1, 2], { [key]: key === 'sensor' ? 'co2' : 9 });
      expect(() => differenceOf(field([1, 2]), other)).toThrow(`difference: ${key} is`);
    },
  );
});

describe('its colours', () => {
  const temperature = sensorNamed('temperature');
  const range = symmetricRange(field([], { valueMin: -1, valueMax: 3 }), temperature);

  test('range as far below 0 as above', () => {
    expect(range).toEqual({ low: -3, high: 3 });
    const less = symmetricRange(field([], { valueMin: -4, valueMax: -1 }), temperature);
    expect(less).toEqual({ low: -4, high: 4 });
  });

  test('are pale where hardly anything has changed, by the ideal range of 18 to 26 °C', () => {
    const hardly = field([], { valueMin: -0.1, valueMax: 0.25 });
    const { low, high } = symmetricRange(hardly, temperature);
    expect([low, high]).toEqual([-high, expect.closeTo(0.4)]);
    const none = { ideal: null, critical: null };
    expect(symmetricRange(hardly, none)).toEqual({ low: -0.25, high: 0.25 });
  });

  test('are grey and to be seen at 0, blue below and orange above, the same far off', () => {
    const none = divergingShade(range)(0, 0);
    const less = divergingShade(range)(-3, 0);
    const more = divergingShade(range)(3, 0);
    expect(none.rgb).toEqual([128, 128, 128]);
    expect(none.alpha).toBeGreaterThan(0.1);
    expect(less.rgb[2]).toBeGreaterThan(less.rgb[0] + 100);
    expect(more.rgb[0]).toBeGreaterThan(more.rgb[2] + 100);
    expect(less.alpha).toBe(more.alpha);
    expect(divergingShade(range)(-99, 0)).toEqual(less);
    expect(divergingShade(range)(1, 0).alpha).toBeCloseTo(divergingShade(range)(-1, 0).alpha);
  });

  test('are grey where nothing has changed anywhere', () => {
    expect(divergingShade({ low: 0, high: 0 })(0, 0).rgb).toEqual([128, 128, 128]);
  });
});

test('a difference has its sign and unit, and no offset of 32 °F', () => {
  const temperature = sensorNamed('temperature');
  expect(differenceText(temperature, 1.3)).toBe('+1.3\u00a0°C');
  expect(differenceText(sensorNamed('temperature', 'F'), -1)).toBe('\u22121.8\u00a0°F');
  expect(differenceText(temperature, 0)).toBe('0.0\u00a0°C');
  expect(differenceText(temperature, -0.001)).toBe('0.0\u00a0°C');
  expect(differenceText(sensorNamed('spin'), 4)).toBe('+4.0');
});

const NOT_JUDGED = { verdict: 'unknown', reasons: [] } as const;

const at = (
  temperature: number | null | undefined,
  sec: number,
  reasons: readonly HealthReason[] = [],
): TagThen => ({
  tag: tag({
    readings: temperature === undefined ? [] : readings({ temperature }, sec),
  }),
  health: judgement({ '1': reasons }).tags['1'] ?? NOT_JUDGED,
});

const old = (sensor: string): HealthReason =>
  reason({ kind: 'old', verdict: 'unknown', sensor, value: null, limit: 600 });
const trend = (now: TagThen, then: TagThen | null): unknown => trendOf('temperature', now, then);

describe('a trend', () => {
  test('is what is now less what was then', () => {
    expect(trend(at(22, 4_000), at(20.5, 400))).toEqual({ kind: 'by', by: 1.5 });
  });

  test.each([
    ['the tag was not known', null],
    ['it had no such sensor', at(undefined, 400)],
    ['the sensor gave no number', at(null, 400)],
    ['the reading did not hold any more', at(20, 1, [old('temperature')])],
    ['none of the tag’s did', at(20, 1, [old('')])],
  ])('is none where %s', (_, then) => {
    expect(trend(at(22, 4_000), then)).toEqual({ kind: 'none' });
  });

  test('of another sensor’s age nothing follows', () => {
    expect(trend(at(22, 4_000), at(20, 400, [old('co2')]))).toEqual({ kind: 'by', by: 2 });
  });

  test('of the very same reading there is none', () => {
    expect(trend(at(22, 400), at(22, 400))).toEqual({ kind: 'same' });
  });

  test.each([at(undefined, 1), at(null, 1), at(22, 1, [old('')]), at(22, 1, [old('temperature')])])(
    'nothing is said where nothing holds now',
    (now) => {
      expect(trend(now, at(20, 0))).toBeNull();
    },
  );
});

test.each([
  ['temperature', 1.26, 'C', 'up', '+1.3\u00a0°C', '/h'],
  ['temperature', 1, 'F', 'up', '+1.8\u00a0°F', '/h'],
  ['temperature', -0.04, 'C', 'level', 'steady', ''],
  ['temperature', -0.06, 'C', 'down', '\u22120.1\u00a0°C', '/h'],
  ['light', 0.4, 'C', 'level', 'steady', ''],
  ['light', -12.2, 'C', 'down', '\u221212\u00a0lx', '/h'],
  ['ph', 0.2, 'C', 'up', '+0.20', '/h'],
  ['vpd', -0.012, 'C', 'down', '\u22120.01\u00a0kPa', '/h'],
  // Its unit has a time already.
  ['daily_light_integral', 1, 'C', 'up', '+1.0\u00a0mol/m²/d', ''],
] as const)('a difference of %s by %d in °%s: %s, %s%s', (name, by, unit, way, text, per) => {
  expect(differenceShown(sensorNamed(name, unit), by)).toEqual({ way, text, rate: text + per });
});
