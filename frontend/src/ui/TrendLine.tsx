import type { JSX } from 'react';

import type { TagHealth } from '../contract/types';
import type { Sensor } from '../domain/sensors';
import type { TemperatureUnit } from '../domain/format';
import { shown } from '../domain/text';
import { differenceShown, trendOf } from '../domain/difference';
import type { Tag } from '../domain/twin';
import { shortHourText, thenOf, type HourAgo } from '../store/hourAgo';
import { S } from '../strings';

export const ARROWS = { up: '\u2197', down: '\u2198', level: '\u2192' } as const;

/** A reading against an hour ago: an arrow and the difference, or why there is none. */
export function TrendLine({
  sensor,
  tag,
  health,
  then,
  unit,
}: {
  sensor: Sensor;
  tag: Tag;
  health: TagHealth;
  /** Null: nobody knows what was an hour ago. */
  then: HourAgo | null;
  unit: TemperatureUnit;
}): JSX.Element | null {
  const value = tag.readings.get(sensor.name);
  const trend = trendOf(sensor.name, { tag, health }, thenOf(then, tag, sensor.name));
  if (!trend || value == null) return null;
  const title = S.trendTitle(shown(sensor.label, 32), shortHourText());
  if (!then || trend.kind !== 'by') {
    if (then && trend.kind === 'same')
      return (
        <span className="trend" data-trend="same" title={S.trendSame}>
          {S.trendSame}
        </span>
      );
    // Only to be heard: with a young memory it would stand in every row.
    return <span className="unseen">{then ? S.trendNone : S.trendUnknown}</span>;
  }
  const { way, text } = differenceShown(sensor, trend.by, unit);
  return (
    <span className="trend" data-trend={way} title={`${title}: ${text}`}>
      <span aria-hidden="true">{ARROWS[way]}</span> <span className="unseen">{title}: </span>
      {text}
    </span>
  );
}
