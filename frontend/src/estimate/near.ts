/** What an estimate at a point has to go by: the tags near it. Pure. */
import type { HouseHealth } from '../domain/health';
import type { When } from '../domain/age';
import type { Tag } from '../domain/twin';
import type { MapPoint } from '../geometry/coordinates';

/** As far as what is read at one place is usually like what is read at another, metres. */
export const NEAR_M = 2.5;

export interface Near {
  readonly count: number;
  /** When the oldest of their readings was made; "never": there is none. */
  readonly oldest: When;
}

/** The tags with a reading of the sensor within reach; not those that the estimate leaves out. */
export function nearTo(
  point: MapPoint,
  tags: readonly Tag[],
  sensor: string,
  { byTag }: Pick<HouseHealth, 'byTag'>,
): Near {
  const hasChanged = ({ id }: Tag): boolean =>
    byTag.get(id)?.reasons.some((each) => each.kind === 'changed' && each.sensor === sensor) ??
    false;
  const near = tags.filter(
    (tag) =>
      tag.at &&
      tag.readings.get(sensor) != null &&
      Math.hypot(tag.at.x - point.x, tag.at.y - point.y) <= NEAR_M &&
      !hasChanged(tag),
  );
  const times = near.map(({ readAt }) => readAt.get(sensor) ?? 'unknown');
  const known = times.filter((when) => typeof when === 'number');
  const oldest = known.length < times.length ? 'unknown' : Math.min(...known);
  return { count: near.length, oldest: near.length === 0 ? 'never' : oldest };
}
