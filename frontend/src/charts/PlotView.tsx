import 'uplot/dist/uPlot.min.css';
import '../styles/charts.css';

import { useEffect, useLayoutEffect, useRef, useState, type JSX } from 'react';

import { rangeText, readingText } from '../domain/format';
import { rosText } from '../domain/rostime';
import { lastUntil, pointAt, type Bucket, type Reading } from '../domain/series';
import { shown } from '../domain/text';
import { unitOf } from '../domain/units';
import { CommentMarks } from '../notes/CommentMarks';
import { act, useApp } from '../store/app';
import { useSelected } from '../store/create';
import { pointedBy, pointedTime } from '../store/signals';
import { onThemeChange } from '../store/theme';
import { S } from '../strings';
import { isStroked, lookOf, markerPath } from './looks';
import type { Line, PlotModel } from './model';
import { createPlot, type Plot } from './plot';
import { plotText } from './told';
import { zoomTo } from './zoom';

/** One chart with its legend: the values under the mouse, else of the moment that the page shows. */
export function PlotView({ model, height }: { model: PlotModel; height: number }): JSX.Element {
  const place = useRef<HTMLDivElement>(null);
  const plot = useRef<Plot | null>(null);
  const [width, setWidth] = useState(0);
  const [own, setAt] = useState<number | null>(null);
  const ofBar = useSelected(pointedTime, pointedBy('bar'));
  const pointed = own ?? ofBar;
  const moment = useApp((state) => state.view.moment);
  // Beside a house of the past, the newest value would pass for one of then.
  const at = pointed ?? moment;
  const pointOf = pointed === null ? lastUntil : pointAt;

  useLayoutEffect(() => {
    const element = place.current;
    if (!element) return undefined;
    const mine = createPlot(element, {
      onPoint: (time) => {
        setAt(time);
        pointedTime.dispatch(time === null ? null : { at: time, by: 'chart' });
      },
      onPick: (time) => {
        act({ type: 'moment', moment: time });
      },
      onZoom: zoomTo,
    });
    plot.current = mine;
    const resize = new ResizeObserver(([entry]) => {
      if (entry) setWidth(Math.floor(entry.contentRect.width));
    });
    resize.observe(element);
    const stop = onThemeChange(mine.recolour);
    return () => {
      plot.current = null;
      stop();
      resize.disconnect();
      mine.destroy();
      pointedTime.dispatch(null);
    };
  }, []);

  useEffect(() => {
    plot.current?.point(ofBar);
  }, [ofBar]);

  useEffect(() => {
    if (width > 0) plot.current?.show(model, { width, height });
  }, [model, width, height]);

  return (
    <section className="plot-view" aria-label={S.chartOf(shown(model.sensor.label, 32))}>
      <header>
        <h3>
          {shown(model.sensor.label, 32)}{' '}
          <span className="faint">{unitOf(model.sensor, model.unit)}</span>
        </h3>
        <ul className="plot-legend">
          {model.lines.map((line) => (
            <LegendLine
              key={line.series.tagId}
              line={line}
              model={model}
              point={pointOf(line.series, at ?? Infinity)}
              before={beforeAt(line, at)}
              isNamed={model.lines.length > 1}
            />
          ))}
        </ul>
        {model.isMixed && <span className="faint">{S.chartIdealsDiffer}</span>}
        {at !== null && <span className="plot-time faint">{rosText(at)}</span>}
      </header>
      <div className="plot-comments">
        <CommentMarks span={model.span} tagIds={model.lines.map(({ series }) => series.tagId)} />
      </div>
      <div
        ref={place}
        className="plot-place"
        role="img"
        aria-label={plotText(model)}
        style={{ height }}
        data-testid="plot"
      />
    </section>
  );
}

function LegendLine({
  line,
  model: { sensor, unit },
  point,
  before,
  isNamed,
}: {
  line: Line;
  model: PlotModel;
  point: Reading | Bucket | null;
  before: Reading | Bucket | null;
  isNamed: boolean;
}): JSX.Element {
  const { label } = line;
  const value = valueOf(point);
  const was = valueOf(before);
  return (
    <li>
      {isNamed && (
        <>
          <LineSign look={line.look} />
          <bdi>{label}</bdi>{' '}
        </>
      )}
      <strong>{value === null ? S.chartNothing : readingText(sensor, value, unit)}</strong>
      {point && 'mean' in point && point.n > 1 && (
        <span className="faint">
          {' '}
          {rangeText(sensor, { low: point.min, high: point.max }, unit)}
        </span>
      )}
      {line.before && (
        <span className="faint">
          {' '}
          {S.chartBeforeWas(was === null ? S.chartNothing : readingText(sensor, was, unit))}
        </span>
      )}
    </li>
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
