import type { JSX } from 'react';

import { differenceShown } from '../domain/difference';
import type { Sensor } from '../domain/sensors';
import { shown } from '../domain/text';
import { S } from '../strings';

const ARROWS = { up: '\u2197', down: '\u2198', level: '\u2192' } as const;

/** Up, down or level compared with an hour ago; `hour` is its length in words if it is a short one. */
export function Trend({
  sensor,
  by,
  hour,
  className,
}: {
  sensor: Sensor;
  by: number;
  hour: string | null;
  className?: string;
}): JSX.Element {
  const { way, text, rate } = differenceShown(sensor, by);
  const title = `${S.trendTitle(shown(sensor.label, 32), hour)}: ${text}`;
  return (
    <span className={className} data-trend={way} title={title}>
      <span aria-hidden="true">
        {ARROWS[way]} <span className="rate">{rate}</span>
      </span>{' '}
      <span className="unseen">{title}</span>
    </span>
  );
}
