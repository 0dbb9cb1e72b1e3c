import type { JSX } from 'react';

import type { Field } from '../contract/types';
import { ageSeconds, type When } from '../domain/age';
import { cellAt } from '../domain/field';
import { shortAgeText } from '../domain/format';
import type { HouseHealth } from '../domain/health';
import type { Tag } from '../domain/twin';
import type { MapPoint } from '../geometry/coordinates';
import { useApp } from '../store/app';
import { selectHealth, selectSensor } from '../store/derived';
import { selectShown, selectTags } from '../store/moment';
import { S } from '../strings';
import { useTicking } from '../widgets/useNow';
import { errorText, estimateText } from './texts';
import { E } from './words';

/** The estimate at a point with its error, and what it has to go by there. */
export function EstimateReadout({
  point,
  field,
  value,
  isError,
}: {
  point: MapPoint;
  field: Field;
  /** Of the cell that holds the point; null: it is not known. */
  value: number | null;
  isError: boolean;
}): JSX.Element {
  const sensor = useApp(selectSensor);
  const unit = useApp((state) => state.settings.unit);
  const tags = useApp(selectTags);
  const health = useApp(selectHealth);
  const ageing = useApp((state) => selectShown(state).ageing);
  const { count, oldest } = nearTo(point, tags, sensor.name, health);
  const age = useTicking((now) => {
    const seconds = ageSeconds(oldest, now, ageing);
    return seconds === null ? null : shortAgeText(seconds);
  });
  const sd = field.sureness?.sd[cellAt(field, point) ?? -1] ?? NaN;
  const text =
    value === null
      ? S.notKnown
      : isError
        ? `±\u00a0${errorText(sensor, sd, unit)}`
        : estimateText(sensor, value, sd, unit);
  return (
    <>
      <strong>{text}</strong>
      <span data-testid="readout-near">
        {E.near(count)}
        {count > 0 && age !== null && `, ${E.oldest(age)}`}
      </span>
    </>
  );
}

/** What an estimate at a point has to go by: the tags near it. Pure. */

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
