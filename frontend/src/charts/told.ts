/** Charts in words. */
import { readingText } from '../domain/format';
import type { Span } from '../domain/period';
import { rosText } from '../domain/rostime';
import type { Sensor } from '../domain/sensors';
import { summaryOf, type Series } from '../domain/series';
import { shown } from '../domain/text';
import type { TemperatureUnit } from '../domain/units';
import { S } from '../strings';
import type { PlotModel } from './model';

export const spanText = ({ from, to }: Span): string => S.chartSpan(rosText(from), rosText(to));

/** The latest, the least and the most, and how often nothing came. */
export function seriesText(series: Series, sensor: Sensor, unit: TemperatureUnit): string {
  const { count, latest, min, max, gaps } = summaryOf(series);
  if (!latest || min === null || max === null) return S.chartEmpty;
  const value = (of: number): string => readingText(sensor, of, unit);
  return S.chartSummary(
    count,
    value(latest.value),
    rosText(latest.at),
    value(min),
    value(max),
    gaps,
  );
}

/** What a canvas shows, for those who do not see it. */
export function plotText({ sensor, unit, lines, span }: PlotModel): string {
  const each = lines.map(({ series, label }) => `${label}: ${seriesText(series, sensor, unit)}`);
  return `${S.chartOf(shown(sensor.label, 32))}, ${spanText(span)}. ${each.join(' ')}`;
}
