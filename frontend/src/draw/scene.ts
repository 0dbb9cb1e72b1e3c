/** What to draw, from the data: one list each of pins, blooms and boxes. Pure. */
import { ageSeconds, freshness, type Ageing } from '../domain/age';
import { readingText } from '../domain/format';
import type { HouseHealth } from '../domain/health';
import { fraction, type Range } from '../domain/ramp';
import type { Sensor } from '../domain/sensors';
import { speciesLooks, UNKNOWN_SPECIES, type BloomLook } from '../domain/species';
import { shown } from '../domain/text';
import type { Snapshot } from '../domain/twin';
import type { TemperatureUnit } from '../domain/units';
import type { MapPoint } from '../geometry/coordinates';

/** Steps of colour and of fading; more cannot be told apart and would cost sprites. */
const COLOUR_STEPS = 32;
const FADE_STEPS = 6;

export interface Pin {
  readonly id: string;
  readonly at: MapPoint;
  /**
   * - value: the tag has this sensor and a reading
   * - failed: it has this sensor, whose reading is not a number
   * - lacking: it has no such sensor
   */
  readonly kind: 'value' | 'failed' | 'lacking';
  /** Place of the value in the range, 0 to 1; 0 without a value. */
  readonly share: number;
  /** How fresh, 0.35 to 1. */
  readonly strength: number;
  readonly pest: boolean;
  /** Label texts from the most to the least telling. */
  readonly texts: readonly string[];
  readonly priority: number;
}

export interface BloomDot {
  readonly at: MapPoint;
  readonly look: BloomLook;
}

export interface Scene {
  readonly pins: readonly Pin[];
  readonly blooms: readonly BloomDot[];
  readonly boxes: readonly (readonly MapPoint[])[];
}

export interface SceneInput {
  readonly snapshot: Snapshot;
  readonly health: HouseHealth;
  readonly sensor: Sensor;
  readonly range: Range | null;
  readonly unit: TemperatureUnit;
  /** ms on the monotonic clock. */
  readonly now: number;
  readonly ageing: Ageing;
}

export function buildScene(input: SceneInput): Scene {
  const { snapshot } = input;
  const looks = speciesLooks(snapshotSpecies(snapshot));
  const boxes = new Map<string, readonly MapPoint[]>();
  const blooms: BloomDot[] = [];
  const pins: Pin[] = [];
  for (const tag of snapshot.tags) {
    if (tag.footprint.length >= 3) {
      boxes.set(tag.footprint.map(({ x, y }) => `${x},${y}`).join(' '), tag.footprint);
    }
    for (const { at, species } of tag.blooms) {
      blooms.push({ at, look: looks.get(species) ?? UNKNOWN_SPECIES });
    }
    if (tag.at) pins.push(pinOf(tag, tag.at, input));
  }
  return { pins, blooms, boxes: [...boxes.values()] };
}

function pinOf(
  tag: Snapshot['tags'][number],
  at: MapPoint,
  { health, sensor, range, unit, now, ageing }: SceneInput,
): Pin {
  const value = tag.readings.get(sensor.name);
  const id = shown(tag.id, 12);
  const strength = freshness(ageSeconds(tag.observedAt, now, ageing));
  const status = health.byTag.get(tag.id)?.status;
  return {
    id: tag.id,
    at,
    kind: value === undefined ? 'lacking' : value === null ? 'failed' : 'value',
    share: value == null || !range ? 0 : quantised(fraction(range, value), COLOUR_STEPS),
    strength: quantised(strength, FADE_STEPS),
    pest: tag.anomaly,
    texts: value == null ? [id] : [`${id} · ${readingText(sensor, value, unit)}`, id],
    priority:
      (tag.anomaly ? 4 : 0) +
      (value == null ? 0 : 2) +
      (status === 'critical' ? 1 : status === 'stressed' ? 0.5 : 0),
  };
}

/** Every species in a snapshot: the planters' and those of single blooms. */
export function snapshotSpecies(snapshot: Snapshot): Set<string> {
  const names = new Set<string>();
  for (const tag of snapshot.tags) {
    if (tag.species) names.add(tag.species);
    for (const bloom of tag.blooms) if (bloom.species) names.add(bloom.species);
  }
  return names;
}

const quantised = (share: number, steps: number): number => Math.round(share * steps) / steps;
