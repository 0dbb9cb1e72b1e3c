import type { JSX } from 'react';

import type { Speech } from '../alarms/words';
import { differenceShown } from '../domain/difference';
import { S } from '../strings';

export const ARROWS = { up: '\u2197', down: '\u2198', level: '\u2192' } as const;

/** Up, down or level compared with an hour ago; `hour` is its length in words if it is a short one. */
export function Trend({
  of,
  by,
  hour,
  speech: { sensors, unit },
}: {
  of: string;
  by: number;
  hour: string | null;
  speech: Speech;
}): JSX.Element {
  const sensor = sensors.named(of);
  const { way, text, rate } = differenceShown(sensor, by, unit);
  const title = `${S.trendTitle(sensor.label, hour)}: ${text}`;
  return (
    <span data-trend={way} title={title}>
      <span aria-hidden="true">
        {ARROWS[way]} {rate}
      </span>{' '}
      <span className="unseen">{title}</span>
    </span>
  );
}
