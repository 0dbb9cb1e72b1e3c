import { sensorNamed } from './sensors';
import type { Tag } from './twin';

/** From the worst to the best, and last what cannot be judged. */
export const HEALTH_STATUSES = ['critical', 'stressed', 'healthy', 'no-data'] as const;
export type HealthStatus = (typeof HEALTH_STATUSES)[number];

/** Distance beyond which more makes no difference, in widths of the ideal range. */
const MAX_DEVIATION = 2;
const STRESSED_FROM = 0.3;
const CRITICAL_FROM = 0.7;

/**
 * How far a value lies outside its ideal range: 0 inside, else the distance to the nearest bound
 * over the range's width, at most 2.
 */
export function deviation([low, high]: readonly [number, number], value: number): number {
  if (value >= low && value <= high) return 0;
  const distance = value < low ? low - value : value - high;
  return Math.min(MAX_DEVIATION, distance / (high - low));
}

/** Which side of the ideal range a value lies on. */
export function sideOf(
  ideal: readonly [number, number] | null,
  value: number,
): 'below' | 'within' | 'above' | null {
  if (!ideal) return null;
  return value < ideal[0] ? 'below' : value > ideal[1] ? 'above' : 'within';
}

export function statusOf(deviation: number | null): HealthStatus {
  if (deviation === null) return 'no-data';
  if (deviation < STRESSED_FROM) return 'healthy';
  return deviation < CRITICAL_FROM ? 'stressed' : 'critical';
}

export interface TagHealth {
  readonly tagId: string;
  readonly status: HealthStatus;
  /** Of the worst sensor; null without a judged reading. */
  readonly deviation: number | null;
  /** The sensor that drives it, and its value. */
  readonly sensor: string | null;
  readonly value: number | null;
}

/** Tags are shared from one snapshot to the next; so is what follows from them. */
const judged = new WeakMap<Tag, TagHealth>();

/** A tag is as healthy as its worst sensor; of equals, the first reported. */
export function tagHealth(tag: Tag): TagHealth {
  const known = judged.get(tag);
  if (known) return known;
  const health = judge(tag);
  judged.set(tag, health);
  return health;
}

function judge(tag: Tag): TagHealth {
  let worst: TagHealth = {
    tagId: tag.id,
    status: 'no-data',
    deviation: null,
    sensor: null,
    value: null,
  };
  for (const [name, value] of tag.readings) {
    const { ideal } = sensorNamed(name);
    if (!ideal || value === null) continue;
    const far = deviation(ideal, value);
    if (worst.deviation === null || far > worst.deviation) {
      worst = { tagId: tag.id, status: statusOf(far), deviation: far, sensor: name, value };
    }
  }
  return worst;
}

export interface HouseHealth {
  readonly status: HealthStatus;
  /** The tag that drives it; null without a judged reading. */
  readonly worst: TagHealth | null;
  readonly counts: Readonly<Record<HealthStatus, number>>;
  readonly byTag: ReadonlyMap<string, TagHealth>;
}

/** The house is as healthy as its worst tag; of equals, the first in the order of ids. */
export function houseHealth(tags: readonly Tag[]): HouseHealth {
  const counts = { healthy: 0, stressed: 0, critical: 0, 'no-data': 0 };
  const byTag = new Map<string, TagHealth>();
  let worst: TagHealth | null = null;
  for (const tag of tags) {
    const health = tagHealth(tag);
    byTag.set(tag.id, health);
    counts[health.status] += 1;
    if (health.deviation === null) continue;
    if (worst?.deviation == null || health.deviation > worst.deviation) worst = health;
  }
  return { status: worst?.status ?? 'no-data', worst, counts, byTag };
}

/** Tags that are critical now and were not before; those of a tag that is new too. */
export function newlyCritical(before: HouseHealth, now: HouseHealth): TagHealth[] {
  if (now === before || now.counts.critical === 0) return [];
  return [...now.byTag.values()].filter(
    ({ tagId, status }) => status === 'critical' && before.byTag.get(tagId)?.status !== 'critical',
  );
}
