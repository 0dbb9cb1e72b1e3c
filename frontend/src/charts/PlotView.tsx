import 'uplot/dist/uPlot.min.css';
import '../styles/charts.css';

import { type CSSProperties, type JSX, useEffect, useMemo, useRef } from 'react';

import { ageText, rangeText, readingText } from '../domain/format';
import { rangeOf, rgbText, sensorColour } from '../domain/ramp';
import { isHad, isOfDay, type Sensor } from '../domain/sensors';
import { lastUntil, type Mark, type Point, pointAt, type Series } from '../domain/series';
import { shown } from '../domain/text';
import { rosText, type Span } from '../domain/time';
import { NoteMarks } from '../notes/NoteMarks';
import { act, useApp } from '../store/app';
import { pointedTime, useSelected } from '../store/create';
import { selectCatalogue } from '../store/derived';
import { onThemeChange } from '../store/theme';
import { S } from '../strings';
import { Select } from '../widgets/controls';
import { isStroked, lookOf, markerPath } from './layers';
import type { Line, PlotModel } from './model';
import { type PlotHandlers, pointOn, usePlot } from './plot';
import { type Charts, useSensorsOf } from './useCharts';
import { zoomTo } from './zoom';
import { DAY_S } from '../domain/difference';

const HANDLERS: PlotHandlers = {
  onPoint: pointedTime.set,
  onPick: (moment) => act({ moment }),
  onZoom: zoomTo,
};

/** One chart. `isAlone`: its one line has the sensor's colour, and no list beside it with its value. */
export function PlotView({
  model,
  height,
  isAlone = true,
  hasTimes = true,
}: {
  model: PlotModel;
  height: number;
  isAlone?: boolean;
  hasTimes?: boolean;
}): JSX.Element {
  const place = useRef<HTMLDivElement>(null);
  const pointed = useSelected(pointedTime);
  const { at } = useReadoutTime();
  const only = isAlone ? model.lines[0] : undefined;

  const plot = usePlot(place, model, height, hasTimes, HANDLERS, onThemeChange);
  useEffect(() => {
    pointOn(plot.current, pointed);
  }, [plot, pointed, model]);

  return (
    <section
      className="plot-view"
      aria-label={S.chartOf(shown(model.sensor.label, 32))}
      data-alone={isAlone}
      data-has-readout={at !== null}
      style={{ '--sensor': rgbText(sensorColour(model.sensor)) } as CSSProperties}
    >
      <header>
        <h3>
          {shown(model.sensor.label, 32)} <span className="faint">{model.sensor.unit}</span>
        </h3>
        {only && <LineValue line={only} model={model} />}
        {model.isMixed && <span className="faint">{S.chartIdealsDiffer}</span>}
        {at !== null && <span className="plot-time faint">{rosText(at)}</span>}
      </header>
      <div className="plot-comments">
        <NoteMarks span={model.span} tagIds={model.lines.map(({ series }) => series.tagId)} />
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

/** The time of the values beside charts: under the mouse, else the page's moment; null: the latest. */
function useReadoutTime(): { at: number | null; isPointed: boolean } {
  const pointed = useSelected(pointedTime);
  // At a past moment, the latest value would be misleading.
  const moment = useApp((state) => state.view.moment);
  return { at: pointed ?? moment, isPointed: pointed !== null };
}

/** A line's value at that time, its range there, and its value the day before. */
export function LineValue({
  line,
  model: { sensor, span },
}: {
  line: Line;
  model: PlotModel;
}): JSX.Element {
  const { at, isPointed } = useReadoutTime();
  const point = (isPointed ? pointAt : lastUntil)(line.series, at ?? Infinity);
  const value = point?.value ?? null;
  const was = beforeAt(line, at)?.value ?? null;
  const isMean = point !== null && point.n > 1;
  const { min = null, max = null } = point ?? {};
  const reach = useApp((state) => state.twin.remembered.value?.reach);
  if (value === null && isOfDay(sensor)) {
    const known = reach ? Math.max(0, (at ?? span.to) - reach.from) : 0;
    return <span className="faint">{S.chartNeedsDay(known < DAY_S ? ageText(known) : null)}</span>;
  }
  return (
    <span className="line-value">
      {isMean && <span className="faint">{S.chartColumns.mean} </span>}
      <strong>{value === null ? S.noValue : readingText(sensor, value)}</strong>
      {isMean && (
        <span className="faint">
          {' '}
          {rangeText(sensor, min === null || max === null ? null : [min, max])}
        </span>
      )}
      {line.before && (
        <span className="faint">
          {' '}
          {S.chartBeforeWas(was === null ? S.noValue : readingText(sensor, was))}
        </span>
      )}
    </span>
  );
}

/** The point of the day before, at a moment or at the line's latest reading. */
function beforeAt({ series, before }: Line, at: number | null): Point | null {
  const newest = lastUntil(series, Infinity);
  return before && newest && pointAt(before, at ?? newest.at);
}

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
      <path d={markerPath(marker, 15, 6, 7)} className={isStroked(marker) ? undefined : 'filled'} />
    </svg>
  );
}

/** Key to the marks below the lines, with their numbers; nothing if there are none. */
export function MarksKey({ marks }: { marks: readonly Mark[] }): JSX.Element | null {
  const count = (kind: Mark['kind']): number =>
    marks.reduce((sum, mark) => sum + (mark.kind === kind ? mark.count : 0), 0);
  const [inspections, failures] = [count('inspection'), count('failure')];
  if (inspections + failures === 0) return null;
  return (
    <p className="marks-key" data-testid="marks-key">
      {inspections > 0 && (
        <span data-mark="inspection">
          <span aria-hidden="true">•</span> {S.chartInspections(inspections)}
        </span>
      )}
      {failures > 0 && (
        <span data-mark="failure">
          <span aria-hidden="true">✕</span> {S.chartFailures(failures)}
        </span>
      )}
    </p>
  );
}

export function ChartState({
  charts: { state, message, span },
  hasLines,
  lacks,
}: {
  charts: Charts;
  hasLines: boolean;
  /** What has no data to chart; null: there is some. */
  lacks: string | null;
}): JSX.Element | null {
  const text =
    lacks ??
    (span === null
      ? S.chartNoTime
      : state === 'failed'
        ? S.chartFailed(shown(message, 300))
        : state === 'waiting' && !hasLines
          ? S.chartLoading
          : null);
  if (text === null) return null;
  return (
    <div className="chart-state" role="status" data-state={state}>
      {text}
    </div>
  );
}

/** Choice of the tag's charted sensor; computed ones included. */
export function SensorChoice({
  tagId,
  value,
  onChange,
}: {
  tagId: string;
  value: string;
  onChange: (sensor: string) => void;
}): JSX.Element {
  const sensors = useSensorsOf(tagId);
  const catalogue = useApp(selectCatalogue);
  const choices = useMemo(() => {
    const computed = catalogue.all.filter((sensor) =>
      isHad(sensor, (name) => sensors.includes(name)),
    );
    return [...new Set([...sensors, ...computed.map(({ name }) => name)])];
  }, [catalogue, sensors]);
  return (
    <Select
      aria-label={S.sensors}
      value={value}
      options={choices}
      text={(name) => {
        const { label, unit } = catalogue.named(name);
        return [shown(label, 32), unit].filter(Boolean).join(', ');
      }}
      onChange={onChange}
    />
  );
}

export const spanText = ({ from, to }: Span): string => S.chartSpan(rosText(from), rosText(to));

/** The latest, least and largest value, and the number of gaps. */
function seriesText({ points, gaps }: Series, sensor: Sensor): string {
  const latest = points.findLast(({ value }) => value !== null);
  const range = rangeOf(points.flatMap(({ min, max }) => [min, max]));
  if (latest?.value == null || !range) return S.chartEmpty;
  const value = (of: number): string => readingText(sensor, of);
  return S.chartSummary(
    points.reduce((sum, { n }) => sum + n, 0),
    value(latest.value),
    rosText(latest.at),
    value(range.low),
    value(range.high),
    gaps.length,
  );
}

function plotText({ sensor, lines, span }: PlotModel): string {
  const each = lines.map(({ series, label }) => `${label}: ${seriesText(series, sensor)}`);
  return `${S.chartOf(shown(sensor.label, 32))}, ${spanText(span)}. ${each.join(' ')}`;
}
