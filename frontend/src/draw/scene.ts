/** What to draw, derived from the data: lists of pins, blooms and boxes. Pure. */
import type { Verdict } from '../contract/types';
import { ageSeconds, freshness } from '../domain/time';
import { readingText } from '../domain/format';
import { isBad, type HouseHealth } from '../domain/health';
import { memoLast, memoOne, type Shared } from '../domain/memo';
import { readingOf, type Sensor } from '../domain/sensors';
import { speciesLooks, UNKNOWN_SPECIES, type BloomLook } from '../domain/marks';
import { shown } from '../domain/text';
import type { Tag } from '../domain/twin';
import { boundsOf, type MapPoint } from '../geometry/coordinates';

/** Steps of fading; more would be indistinguishable. */
const FADE_STEPS = 6;
/** A warning pin stays visible, however old its data. */
const FAINTEST_WARNING = 5 / 6;
/** Pins outside the filter stay, but faint. */
const LEFT_OUT = 1 / 6;

export type Pin = Shared<ReturnType<typeof pinOf>>;

export interface Scene {
  readonly pins: readonly Pin[];
  readonly blooms: readonly { readonly at: MapPoint; readonly look: BloomLook }[];
  readonly boxes: readonly (readonly MapPoint[])[];
  /** Distance between pins if they are many, m; else infinite. */
  readonly spacing: number;
}

export interface SceneInput {
  readonly tags: readonly Tag[];
  readonly health: HouseHealth;
  readonly sensor: Sensor;
  /** As of when ages are, ROS seconds; null: unknown. */
  readonly now: number | null;
  /** The tags that pass the table's filter; null: all. */
  readonly listed: ReadonlySet<string> | null;
}

/** The parts that neither fade nor depend on the sensor. */
const planted = memoOne((tags: readonly Tag[]): Pick<Scene, 'blooms' | 'boxes'> => {
  const looks = speciesLooks(speciesOf(tags));
  const blooms = tags.flatMap((tag) =>
    tag.blooms.map(({ at, species }) => ({ at, look: looks.get(species) ?? UNKNOWN_SPECIES })),
  );
  const planters = tags.map(({ footprint }) => footprint).filter(({ length }) => length >= 3);
  const boxes = new Map(planters.map((box) => [JSON.stringify(box), box]));
  return { blooms, boxes: [...boxes.values()] };
});

export function buildScene(input: SceneInput): Scene {
  const pins = input.tags.flatMap((tag) => (tag.at ? [pinOf(tag, tag.at, input)] : []));
  return { ...planted(input.tags), pins, spacing: spacingOf(pins) };
}

/** Fewer pins never hide what is below them. */
export const CROWD = 60;

/** The side of each pin's square if pins were spread evenly over their bounds. */
function spacingOf(pins: readonly Pin[]): number {
  const bounds = pins.length < CROWD ? null : boundsOf(pins.map(({ at }) => at));
  if (!bounds) return Infinity;
  const { minX, minY, maxX, maxY } = bounds;
  return Math.sqrt(((maxX - minX) * (maxY - minY)) / pins.length) || Infinity;
}

function pinOf(tag: Tag, at: MapPoint, input: SceneInput) {
  const { health, sensor, now, listed } = input;
  const isLeftOut = listed !== null && !listed.has(tag.id);
  const name = readingOf(sensor, tag.readings);
  const value = tag.readings.get(name);
  const isLacking = value === undefined;
  const isFailed = value === null;
  const fresh = freshness(ageSeconds(tag.readAt.get(name) ?? tag.scannedAt, now));
  const verdict: Verdict = health.byTag.get(tag.id)?.verdict ?? 'unknown';
  const isWarning = isBad(verdict);
  return {
    id: tag.id,
    at,
    /**
     * - value: the tag has a reading of this sensor, or of the one that it is computed from
     * - failed: the tag has this sensor, but its reading is not a number
     * - lacking: the tag has no such sensor
     */
    kind: isLacking ? ('lacking' as const) : isFailed ? ('failed' as const) : ('value' as const),
    verdict,
    /** Opacity by freshness, 0.35 to 1; a warning is never faint; less outside the filter. */
    strength: isLeftOut
      ? LEFT_OUT
      : Math.max(quantised(fresh, FADE_STEPS), isWarning ? FAINTEST_WARNING : 0),
    pest: tag.anomaly && !isLeftOut,
    /** Label texts, the most detailed first. */
    texts: isLeftOut ? [] : textsOf(tag)(sensor),
    priority:
      (tag.anomaly ? 4 : 0) +
      (isLacking || isFailed ? 0 : 2) +
      (verdict === 'critical' ? 4 : verdict === 'stressed' ? 3 : 0),
  };
}

const textsOf = memoOne((tag: Tag) =>
  memoLast((sensor: Sensor): readonly string[] => {
    const id = shown(tag.id, 12);
    const value = tag.readings.get(sensor.name);
    return value == null ? [id] : [`${id} · ${readingText(sensor, value)}`, id];
  }),
);

export function speciesOf(tags: readonly Tag[]): Set<string> {
  const names = new Set<string>();
  for (const tag of tags) {
    if (tag.species) names.add(tag.species);
    for (const bloom of tag.blooms) if (bloom.species) names.add(bloom.species);
  }
  return names;
}

const quantised = (share: number, steps: number): number => Math.round(share * steps) / steps;
