import { describe, expect, test } from 'vitest';

import { DARK, LIGHT } from '../draw/palette';
import { sensorNamed } from '../testing/sensors';
import { beyond, excess, IDEAL_ALPHA, idealColour, idealText } from './ideal';
import { mix, type Rgb } from './ramp';

const ranges = { ideal: [18, 26], critical: [10, 35] } as const;

test.each([
  [18, 0],
  [26, 0],
  [17.9, -0.1],
  [27, 1],
])('%f lies %f beyond', (value, by) => {
  expect(beyond(ranges, value)).toBeCloseTo(by);
});

describe('excess', () => {
  test.each([
    [22, 0],
    [14, -0.5],
    [10, -1],
    [3, -1],
    [30.5, 0.5],
    [35, 1],
  ])('of %f is %f', (value, share) => {
    expect(excess(ranges, value)).toBeCloseTo(share);
  });

  test('without a critical limit ends at half of the ideal width; of no ideal there is none', () => {
    expect(excess({ ideal: [0, 10], critical: null }, 12.5)).toBe(0.5);
    expect(excess({ ideal: null, critical: null }, 12.5)).toBeNull();
  });

  test('where it is critical at once there is no way between', () => {
    expect(excess({ ideal: [0, 10], critical: [0, 10] }, 10.1)).toBe(1);
    expect(excess({ ideal: [0, 10], critical: [0, 10] }, -0.1)).toBe(-1);
  });
});

describe('words', () => {
  const told = (name: string, value: number, unit: 'C' | 'F' = 'C'): string | null => {
    const sensor = sensorNamed(name);
    return idealText(sensor, sensor, value, unit);
  };

  test.each([
    ['temperature', 18, 'C', 'ideal'],
    ['temperature', 16, 'C', 'too low by 2.0\u00a0°C'],
    ['temperature', 27, 'F', 'too high by 1.8\u00a0°F'],
    ['temperature', 26.000_01, 'C', 'too high'],
    ['dew_point', 5, 'C', null],
  ] as const)('%s %f %s: %s', (name, value, unit, text) => {
    expect(told(name, value, unit)).toBe(text);
  });
});

/** Machado, Oliveira and Fernandes 2009, severity 1, on linear light. */
const SEEN = {
  normal: [1, 0, 0, 0, 1, 0, 0, 0, 1],
  protanopia: [0.152, 1.053, -0.205, 0.115, 0.786, 0.099, -0.004, -0.048, 1.052],
  deuteranopia: [0.367, 0.861, -0.228, 0.28, 0.673, 0.047, -0.012, 0.043, 0.969],
  tritanopia: [1.256, -0.077, -0.179, -0.078, 0.931, 0.148, 0.005, 0.691, 0.304],
} as const;

/** CIE L*a*b* (D65) of a colour as somebody sees it. */
function lab(colour: Rgb, seen: readonly number[]): [number, number, number] {
  const linear = colour.map((each) => {
    const c = each / 255;
    return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
  });
  const dot = (row: readonly number[], of: readonly number[]): number =>
    row.reduce((sum, weight, index) => sum + weight * (of[index] ?? 0), 0);
  const light = [0, 3, 6].map((at) =>
    Math.max(0, Math.min(1, dot(seen.slice(at, at + 3), linear))),
  );
  const f = (t: number): number => (t > 0.008856 ? Math.cbrt(t) : 7.787 * t + 16 / 116);
  const x = f(dot([0.4124, 0.3576, 0.1805], light) / 0.9505);
  const y = f(dot([0.2126, 0.7152, 0.0722], light));
  const z = f(dot([0.0193, 0.1192, 0.9505], light) / 1.089);
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

describe.each(Object.entries(SEEN))('colours as seen with %s', (_, seen) => {
  test.each([LIGHT, DARK])('are apart from each other and from the floor, $name', ({ floor }) => {
    const painted = (by: number): Rgb => mix(floor, idealColour(by), IDEAL_ALPHA);
    const all = [floor, painted(-1), painted(-0.01), painted(0), painted(0.01), painted(1)];
    const labs = all.map((colour) => lab(colour, seen));
    const apart = labs.flatMap((a, i) =>
      labs.slice(i + 1).map((b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2])),
    );
    // 10 is what is told apart at a glance, side by side.
    expect(Math.min(...apart)).toBeGreaterThan(12);
  });
});
