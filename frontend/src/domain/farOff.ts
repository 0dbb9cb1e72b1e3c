/**
 * Which tags lie so far from the others that they are on no map: `lupin_twin/core/outlying.py`, which says
 * why, has the same rule. Both are held to the cases of `tests/twin/core/far_off.json`.
 */
import type { MapPoint } from '../geometry/coordinates';

/** A circle about the middle of the tags, metres; what is outside is far off. */
export interface Reach {
  readonly x: number;
  readonly y: number;
  readonly radius: number;
}

const FARTHEST_M = 1e6;
const ALWAYS_NEAR_M = 200;
const SPREADS = 10;
const ONE_IN = 3;

const EVERYWHERE: Reach = { x: 0, y: 0, radius: Infinity };

/** Whether a point could be on any map. */
export const isPossible = ({ x, y }: Readonly<{ x: number; y: number }>): boolean =>
  Math.abs(x) <= FARTHEST_M && Math.abs(y) <= FARTHEST_M;

/** Whether a point is on the map. */
export const holds = (reach: Reach, point: MapPoint): boolean =>
  isPossible(point) && Math.hypot(point.x - reach.x, point.y - reach.y) <= reach.radius;

/** The circle of tags at these places. */
export function reachOf(places: readonly MapPoint[]): Reach {
  const possible = places.filter(isPossible);
  const x = medianLow(possible.map((place) => place.x));
  const y = medianLow(possible.map((place) => place.y));
  const distances = possible.map((place) => Math.hypot(place.x - x, place.y - y));
  const radius = Math.max(ALWAYS_NEAR_M, SPREADS * medianLow(distances));
  const far = distances.filter((distance) => distance > radius).length;
  if (possible.length === 0 || far > Math.floor(possible.length / ONE_IN)) return EVERYWHERE;
  return { x, y, radius };
}

/** The middle value; of an even count the lower of the two, 0 of none. */
function medianLow(values: readonly number[]): number {
  const sorted = Float64Array.from(values).sort();
  return sorted[(sorted.length - 1) >> 1] ?? 0;
}
