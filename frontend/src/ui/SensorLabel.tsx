import type { JSX } from 'react';

import type { Sensor } from '../domain/sensors';
import { shown } from '../domain/text';
import { S } from '../strings';

/** In short where the name is long: the full one to be heard, and to be had by pointing at it. */
export function SensorLabel({ sensor }: { sensor: Sensor }): JSX.Element {
  const names: Partial<Record<string, string>> = S.sensorShort;
  const short = Object.hasOwn(names, sensor.name) ? names[sensor.name] : undefined;
  const label = shown(sensor.label, 32);
  if (short === undefined) return <span>{label}</span>;
  return (
    <span title={label}>
      <span aria-hidden="true">{short}</span>
      <span className="unseen">{label}</span>
    </span>
  );
}
