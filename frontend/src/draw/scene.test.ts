import { describe, expect, test } from 'vitest';

import { houseHealth } from '../domain/health';
import { judgement, NOBODY } from '../testing/health';
import { readings, tag } from '../testing/tags';
import type { TwinTagState as WireTag } from '../contract/types';
import type { Tag } from '../domain/twin';
import { buildScene, type Scene } from './scene';
import { sensorNamed } from '../testing/sensors';

const scene = (
  tags: readonly Tag[],
  now = 0,
  health = NOBODY,
  listed: ReadonlySet<string> | null = null,
  sensor = 'temperature',
): Scene =>
  buildScene({
    tags,
    health: houseHealth(tags, health, true),
    sensor: sensorNamed(sensor),
    // From ms since the state of these tags.
    now: 105 + now / 1_000,
    listed,
  });

/** On a square of ten by ten, 1 m apart. */
const at = (index: number): WireTag['pose'] => ({
  position: { x: index % 10, y: Math.floor(index / 10), z: 0 },
  orientation: { x: 0, y: 0, z: 0, w: 1 },
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

  test('a derived value is labelled; a quantity of a day is where a tag has its sensor, without a number', () => {
    const air = { temperature: 20, humidity: 50 };
    const pins = [
      scene([tag({ readings: readings({ ...air, vpd: 1.17 }) })], 0, NOBODY, null, 'vpd').pins,
      scene([tag({ readings: readings(air) })], 0, NOBODY, null, 'vpd').pins,
      scene([tag({ readings: readings(air) })], 0, NOBODY, null, 'day_night_difference').pins,
    ];
    expect(pins.map(([pin]) => [pin?.kind, pin?.texts])).toEqual([
      ['value', ['1 · 1.17\u00a0kPa', '1']],
      ['lacking', ['1']],
      ['value', ['1']],
    ]);
  });

  test('has the verdict that was given, unknown where none was', () => {
    const tags = ['1', '2', '3'].map((tag_id) => tag({ tag_id }));
    const said = judgement({ '1': 'critical', '2': 'healthy' });
    const verdicts = scene(tags, 0, said).pins.map(({ verdict }) => verdict);
    expect(verdicts).toEqual(['critical', 'healthy', 'unknown']);
  });

  test('what the filter leaves out is faint, and has neither label nor pest', () => {
    const tags = [tag({ anomaly: true }), tag({ tag_id: '2' })];
    const [out, listed] = scene(tags, 0, NOBODY, new Set(['2'])).pins;
    expect(out).toMatchObject({ pest: false, texts: [] });
    expect(out?.strength).toBeLessThan(0.2);
    expect(listed?.texts).toEqual(['2']);
  });

  test('many close together say how close, a few do not', () => {
    const row = (count: number): Tag[] =>
      Array.from({ length: count }, (_, index) => tag({ tag_id: String(index), pose: at(index) }));
    expect(scene(row(59)).spacing).toBe(Infinity);
    expect(scene(row(100)).spacing).toBeCloseTo(0.9);
  });

  test('a label tells the value', () => {
    const [pin] = scene([tag({ readings: readings({ temperature: 25 }) })]).pins;
    expect(pin?.texts).toEqual(['1 · 25.0\u00a0°C', '1']);
  });

  test.each(['critical', 'stressed'] as const)(
    'one that is %s never fades out of sight',
    (verdict) => {
      const tags = [tag({ readings: readings({ temperature: 20 }) })];
      const [pin] = scene(tags, 86_400_000, judgement({ '1': verdict })).pins;
      expect(pin?.strength).toBeGreaterThan(0.8);
      const [well] = scene(tags, 86_400_000, judgement({ '1': 'healthy' })).pins;
      expect(well?.strength).toBeLessThan(0.5);
    },
  );

  test('a pin fades with age', () => {
    const tags = [tag({ readings: readings({ temperature: 20 }) })];
    const strength = (now: number): number => scene(tags, now).pins[0]?.strength ?? NaN;
    expect(strength(0)).toBe(1);
    expect(strength(600_000)).toBeLessThan(1);
    expect(strength(600_000)).toBeGreaterThan(0);
  });

  test('by the reading of the sensor in view, not by a later inspection', () => {
    const old = readings({ temperature: 20 }, -3_495);
    const [pin] = scene([tag({ readings: [...old, ...readings({ humidity: 20 }, 104)] })]).pins;
    expect(pin?.strength).toBeLessThan(0.5);
    const unknown = old.map((each) => ({ ...each, observed_at: null }));
    expect(scene([tag({ readings: unknown })]).pins[0]?.strength).toBeLessThan(0.5);
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
