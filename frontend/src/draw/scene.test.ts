import { describe, expect, test } from 'vitest';

import { GROWING } from '../domain/age';
import { houseHealth } from '../domain/health';
import { sensorNamed } from '../domain/sensors';
import { readings, snapshot, tag } from '../testing/tags';
import type { Tag } from '../domain/twin';
import { buildScene, type Scene } from './scene';

const scene = (tags: readonly Tag[], now = 0): Scene =>
  buildScene({
    snapshot: snapshot(tags),
    health: houseHealth(tags),
    sensor: sensorNamed('temperature'),
    range: { low: 10, high: 30 },
    unit: 'C',
    now,
    ageing: GROWING,
  });

describe('pins', () => {
  test('none for a tag without a pose', () => {
    const pose = { position: { x: 0, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 0 } };
    expect(scene([tag({ pose }), tag({ tag_id: '2' })]).pins.map(({ id }) => id)).toEqual(['2']);
  });

  test('a value, a failed sensor and a lacking one are three kinds', () => {
    const kinds = [{ temperature: 20 }, { temperature: null }, { humidity: 50 }].map(
      (values) => scene([tag({ readings: readings(values) })]).pins[0]?.kind,
    );
    expect(kinds).toEqual(['value', 'failed', 'lacking']);
  });

  test('the share follows the range', () => {
    const [pin] = scene([tag({ readings: readings({ temperature: 25 }) })]).pins;
    expect(pin?.share).toBeCloseTo(0.75);
    expect(pin?.texts).toEqual(['1 · 25.0\u00a0°C', '1']);
  });

  test('a pin fades with age', () => {
    const tags = [tag({ stale_seconds: 1 })];
    const strength = (now: number): number => scene(tags, now).pins[0]?.strength ?? NaN;
    expect(strength(0)).toBe(1);
    expect(strength(600_000)).toBeLessThan(1);
    expect(strength(600_000)).toBeGreaterThan(0);
  });

  test('a pest is marked and its label comes first', () => {
    const [sick] = scene([tag({ anomaly: true })]).pins;
    const [well] = scene([tag()]).pins;
    expect(sick?.pest).toBe(true);
    expect(sick?.priority).toBeGreaterThan(well?.priority ?? NaN);
  });

  test('a hostile id stays short', () => {
    const [pin] = scene([tag({ tag_id: '\u202e' + 'x'.repeat(256) })]).pins;
    expect(pin?.texts[0]?.length).toBeLessThanOrEqual(12);
  });
});

test('a box that several tags share is drawn once; a line is no box', () => {
  const points = [
    { x: 0, y: 0, z: 0 },
    { x: 1, y: 0, z: 0 },
    { x: 1, y: 1, z: 0 },
  ];
  const tags = [
    tag({ tag_id: '1', box_footprint: { points } }),
    tag({ tag_id: '2', box_footprint: { points } }),
    tag({ tag_id: '3', box_footprint: { points: points.slice(1) } }),
  ];
  expect(scene(tags).boxes).toHaveLength(1);
});

test('blooms carry their species’ look', () => {
  const bloom = (x: number, species: string): Parameters<typeof tag>[0] => ({
    tag_id: String(x),
    flowers: [{ position: { x, y: 0, z: 0 }, height_m: 0, species, confidence: 1, anomaly: false }],
  });
  const { blooms } = scene([tag(bloom(1, 'rose')), tag(bloom(2, 'tulip')), tag(bloom(3, 'rose'))]);
  const [a, b, c] = blooms.map(({ look }) => String(look.colour));
  expect(a).toBe(c);
  expect(a).not.toBe(b);
});
