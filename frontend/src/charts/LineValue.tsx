import type { JSX } from 'react';

import { ageText, rangeText, readingText } from '../domain/format';
import { isOfDay } from '../domain/sensors';
import { lastUntil, pointAt, type Bucket, type Reading } from '../domain/series';
import { useApp } from '../store/app';
import { useSelected } from '../store/create';
import { pointedTime } from '../store/signals';
import { S } from '../strings';
import { isStroked, lookOf, markerPath } from './looks';
import type { Line, PlotModel } from './model';

const DAY_S = 86_400;

/** The time that charts tell of: under the mouse, else the moment that the page shows; null: newest. */
export function useTold(): { at: number | null; isPointed: boolean } {
  const pointed = useSelected(pointedTime, (it) => it?.at ?? null);
  // Beside a house of the past, the newest value would pass for one of then.
  const moment = useApp((state) => state.view.moment);
  return { at: pointed ?? moment, isPointed: pointed !== null };
}

/** What a line says at that time, how far it ranges there, and what it was the day before. */
export function LineValue({
  line,
  model: { sensor, unit, span },
}: {
  line: Line;
  model: PlotModel;
}): JSX.Element {
  const { at, isPointed } = useTold();
  const point = (isPointed ? pointAt : lastUntil)(line.series, at ?? Infinity);
  const value = valueOf(point);
  const was = valueOf(beforeAt(line, at));
  const reach = useApp((state) => state.twin.remembered.value?.reach);
  if (value === null && isOfDay(sensor)) {
    const known = reach ? Math.max(0, (at ?? span.to) - reach.from) : 0;
    return <span className="faint">{S.chartNeedsDay(known < DAY_S ? ageText(known) : null)}</span>;
  }
  return (
    <span className="line-value">
      {point && 'mean' in point && point.n > 1 && (
        <span className="faint">{S.chartColumns.mean} </span>
      )}
      <strong>{value === null ? S.noValue : readingText(sensor, value, unit)}</strong>
      {point && 'mean' in point && point.n > 1 && (
        <span className="faint">
          {' '}
          {rangeText(sensor, { low: point.min, high: point.max }, unit)}
        </span>
      )}
      {line.before && (
        <span className="faint">
          {' '}
          {S.chartBeforeWas(was === null ? S.noValue : readingText(sensor, was, unit))}
        </span>
      )}
    </span>
  );
}

const valueOf = (point: Reading | Bucket | null): number | null =>
  !point ? null : 'mean' in point ? point.mean : point.value;

/** The day before, at a moment or when the line's newest was read. */
function beforeAt({ series, before }: Line, at: number | null): Reading | Bucket | null {
  const newest = lastUntil(series, Infinity);
  if (!before || !newest) return null;
  return pointAt(before, at ?? ('at' in newest ? newest.at : newest.start));
}

/** A piece of the line with its marker. */
export function LineSign({ look: index }: { look: number }): JSX.Element {
  const { colour, dash, marker } = lookOf(index);
  return (
    <svg
      className="line-sign"
      viewBox="0 0 30 12"
      width={30}
      height={12}
      aria-hidden="true"
      style={{ color: `var(--chart-${colour + 1})` }}
    >
      <path d="M0 6H30" strokeDasharray={dash.join(' ')} />
      <path d={markerPath(marker, 15, 6, 7)} className={isStroked(marker) ? 'stroked' : 'filled'} />
    </svg>
  );
}
