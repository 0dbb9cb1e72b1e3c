import { describe, expect, test } from 'vitest';

import type { HealthReason } from '../contract/types';
import { judgement, reason } from '../testing/health';
import { sensorNamed } from '../testing/sensors';
import { tag } from '../testing/tags';
import { differenceShown, trendOf, type TagThen } from './difference';

const NOT_JUDGED = { verdict: 'unknown', reasons: [] } as const;

const at = (
  temperature: number | null | undefined,
  sec: number,
  reasons: readonly HealthReason[] = [],
): TagThen => ({
  tag: tag({
    readings:
      temperature === undefined
        ? []
        : [
            {
              name: 'temperature',
              value: temperature,
              observed_at: { sec, nanosec: 0 },
              stale_seconds: 5,
            },
          ],
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
  ['temperature', 1.26, 'C', 'up', '+1.3\u00a0°C'],
  ['temperature', 1, 'F', 'up', '+1.8\u00a0°F'],
  ['temperature', -0.04, 'C', 'level', 'steady'],
  ['temperature', -0.06, 'C', 'down', '\u22120.1\u00a0°C'],
  ['light', 0.4, 'C', 'level', 'steady'],
  ['light', -12.2, 'C', 'down', '\u221212\u00a0lx'],
  ['ph', 0.2, 'C', 'up', '+0.20'],
  ['vpd', -0.012, 'C', 'down', '\u22120.01\u00a0kPa'],
] as const)('of %s a difference of %d is told in °%s: %s, %s', (name, by, unit, way, text) => {
  expect(differenceShown(sensorNamed(name), by, unit)).toEqual({ way, text });
});
