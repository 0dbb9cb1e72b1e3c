import type { JSX } from 'react';

import type { Field } from '../contract/types';
import { ageSeconds } from '../domain/age';
import { cellAt } from '../domain/field';
import { shortAgeText } from '../domain/format';
import type { MapPoint } from '../geometry/coordinates';
import { useApp } from '../store/app';
import { selectHealth, selectSensor } from '../store/derived';
import { selectShown, selectTags } from '../store/moment';
import { S } from '../strings';
import { useTicking } from '../widgets/useNow';
import { nearTo } from './near';
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
