import type { JSX } from 'react';

import { differenceShown } from '../domain/difference';
import type { Sensor } from '../domain/sensors';
import { S } from '../strings';

export const ARROWS = { up: '\u2197', down: '\u2198', level: '\u2192' } as const;

/** Up, down or level compared with an hour ago; `hour` is its length in words if it is a short one. */
export function Trend({
  sensor,
  by,
  hour,
}: {
  sensor: Sensor;
  by: number;
  hour: string | null;
}): JSX.Element {
  const { way, text, rate } = differenceShown(sensor, by);
  const title = `${S.trendTitle(sensor.label, hour)}: ${text}`;
  return (
    <span data-trend={way} title={title}>
      <span aria-hidden="true">
        {ARROWS[way]} <span className="rate">{rate}</span>
      </span>{' '}
      <span className="unseen">{title}</span>
    </span>
  );
}
