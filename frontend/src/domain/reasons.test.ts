import { describe, expect, test } from 'vitest';

import { held, reason } from '../testing/health';
import { reasonsText, reasonText, todoText } from './health';
import { S } from '../strings';
import { CATALOGUE } from '../testing/sensors';

const text = (over: Parameters<typeof reason>[0], age: number | null = null): string =>
  reasonText(CATALOGUE, reason(over), 'C', age);
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
      // Within the ideal range of 18 to 26, and not by enough.
      { verdict: 'stressed', value: 18.1, limit: 18, ...held(18.4) } as const,
      null,
      `Temperature 18.1${NBSP}°C, was below 18.0; stays stressed until 18.4`,
    ],
    [
      { verdict: 'stressed', value: 26, limit: 26, ...held(25.6) } as const,
      null,
      `Temperature 26.0${NBSP}°C, was above 26.0; stays stressed until 25.6`,
    ],
    [
      // Within the critical range of 10, by less: of the ideal one it is far off.
      { value: 10.39, limit: 10, ...held(10.4) } as const,
      null,
      `Temperature just below 10.4${NBSP}°C, was below 10.0; stays critical until 10.4`,
    ],
    [
      { sensor: 'vpd', value: 1.68, limit: 1.3, verdict: 'stressed' } as const,
      null,
      `Vapour pressure deficit 1.68${NBSP}kPa, above 1.30`,
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
      { ...old, limit: 1_800 },
      345_600,
      `Not scanned for 4${NBSP}d (readings are valid for 30${NBSP}min)`,
    ],
    [
      { ...old, limit: 86_400, sensor: 'soil_moisture' },
      90_000,
      `Soil moisture: no reading for 1${NBSP}d (readings are valid for 1${NBSP}d)`,
    ],
    [{ ...old, limit: 600 }, null, `Not scanned recently (readings are valid for 10${NBSP}min)`],
    [
      { ...old, limit: 5_400, since: null },
      null,
      `No scan with a known time (readings are valid for 1${NBSP}h 30${NBSP}min)`,
    ],
    [
      { kind: 'changed', value: 22, limit: null } as const,
      null,
      `Temperature 22.0${NBSP}°C: possible sensor fault`,
    ],
    [
      { kind: 'silent', sensor: '', value: null, limit: null } as const,
      null,
      'No data from the twin: its last data may be out of date',
    ],
    [
      { kind: 'stopped', sensor: '', value: null, limit: null } as const,
      null,
      'No tag is being scanned: the robot has stopped, or its data is lost',
    ],
    [{ kind: 'door_open' as never, sensor: '', value: null, limit: null }, null, 'door open'],
  ] as const)('%o', (over, age, told) => {
    expect(text(over, age)).toBe(told);
  });

  test('follows the unit that is chosen', () => {
    expect(reasonText(CATALOGUE, reason(), 'F', null)).toBe(
      `Temperature 43.9${NBSP}°F, below 50.0 (critical)`,
    );
  });

  test('back in its ideal range, nothing has to be done; within what is critical alone, it has', () => {
    expect(todoText(reason({ verdict: 'stressed', value: 18.1, limit: 18, ...held(18.4) }))).toBe(
      '',
    );
    expect(todoText(reason({ value: 10.1, limit: 10, ...held(10.4) }))).not.toBe('');
  });

  test('beside its mark, it does not say again how bad it is', () => {
    expect(reasonText(CATALOGUE, reason(), 'C', null, true)).toBe(
      `Temperature 6.6${NBSP}°C, below 10.0`,
    );
  });

  test('what is well waits for a scan; pests, for another look at the flowers', () => {
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
  expect(reasonsText(CATALOGUE, [reason(), pest], 'C')).toBe(
    `Temperature 6.6${NBSP}°C, below 10.0 (critical); 1 pest seen`,
  );
  expect(reasonsText(CATALOGUE, [], 'C')).toBe('');
});
