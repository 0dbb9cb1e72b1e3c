/** One chart on the page: uPlot with the layers of `layers.ts`. */
import { type RefObject, useLayoutEffect, useRef } from 'react';
import uPlot from 'uplot';

import { toShown } from '../domain/format';
import { hasDate, type Span } from '../domain/time';
import { timeTicks, type Tick } from '../domain/timeline';
import { coloursOf } from '../draw/colours';
import { LOCALE } from '../strings';
import { useSize } from '../widgets/useSize';
import {
  drawAbove,
  drawBelow,
  drawMarks,
  type Frame,
  fontPx,
  lineColour,
  lookOf,
  MARKS_LANE,
} from './layers';
import { aligned, drawnOf, hasMarks, valueRange, type PlotModel } from './model';

export interface PlotHandlers {
  /** The time under the mouse, ROS seconds; null: none. */
  readonly onPoint: (at: number | null) => void;
  readonly onPick?: (at: number) => void;
  readonly onZoom?: (span: Span) => void;
}

/** Height of the times and the lane of marks, CSS pixels. */
export const TIMES_HEIGHT = 44 + MARKS_LANE;
const NO_TIMES_HEIGHT = 8;
/** Dashes of the day before: stroke and pause, CSS pixels. */
const DASH_BEFORE = [3, 3];
/** A shorter drag is a click, CSS pixels. */
const SHORTEST_DRAG = 6;
/** Room right of the plot for half of the last time below it, in font sizes. */
const HALF_A_TIME = 2;
/** All charts share one cursor. */
const SYNC_KEY = 'lupin-charts';
/** In the page's language, while uPlot uses the browser's; with all digits of a small step. */
const AXIS_NUMBER = new Intl.NumberFormat(LOCALE, { maximumSignificantDigits: 9 });

export const axisText = (value: number): string => AXIS_NUMBER.format(value).replace('-', '\u2212');

/** `latest`: the model to draw; one of another shape needs another chart. */
function build(
  element: HTMLElement,
  latest: RefObject<PlotModel>,
  hasTimes: boolean,
  handlers: PlotHandlers,
): uPlot {
  const colour = coloursOf(element);
  const lane = hasMarks(latest.current) ? MARKS_LANE : 0;
  let ticks: readonly Tick[] = [];

  const frameOf = (u: uPlot): Frame => ({
    context: u.ctx,
    box: u.bbox,
    ratio: uPlot.pxRatio,
    x: (at) => u.valToPos(at, 'x', true),
    y: (value) => u.valToPos(toShown(latest.current.sensor, value), 'y', true),
    model: latest.current,
    colour,
  });

  const axis = (): Partial<uPlot.Axis> => ({
    stroke: () => colour('chart-text'),
    grid: { stroke: () => colour('chart-grid'), width: 1 },
    ticks: { stroke: () => colour('chart-grid'), width: 1, size: 5 },
    font: `${fontPx()}px ${colour('font')}`,
  });

  const colourOf = (_: uPlot, series: number): string => {
    const look = drawnOf(latest.current)[series - 1]?.look ?? 0;
    return lineColour(colour, look);
  };

  /** The point of the reading valid then, or of the bucket, as in the value beside the chart. */
  const heldIndex = (u: uPlot, series: number, nearest: number, at: number): number => {
    const drawn = drawnOf(latest.current)[series - 1];
    const [times, values] = [u.data[0], u.data[series]];
    if (!drawn || !values) return nearest;
    // A bucket's point is at its middle.
    const last = at + (drawn.series.bucketS ?? 0) / 2;
    return times.findLastIndex((time, index) => time <= last && values[index] !== undefined);
  };

  const chart = new uPlot(
    {
      // Until its place is measured.
      ...{ width: 300, height: 150 },
      class: 'plot',
      legend: { show: false },
      padding: [8, HALF_A_TIME * fontPx(), 0, 0],
      cursor: {
        y: false,
        dataIdx: heldIndex,
        points: { size: 8, width: 2, stroke: () => colour('chart-surface'), fill: colourOf },
        drag: { x: true, y: false, setScale: false, dist: SHORTEST_DRAG },
        sync: {
          key: SYNC_KEY,
          scales: ['x', null],
          // A drag must not act on the other charts.
          filters: { pub: (type) => type !== 'mousedown' && type !== 'mouseup' },
        },
      },
      scales: {
        x: {
          time: false,
          range: () => [latest.current.span.from, latest.current.span.to],
        },
        y: { range: () => valueRange(latest.current) },
      },
      series: [
        {},
        ...drawnOf(latest.current).map(({ look, isBefore }) => ({
          stroke: () => lineColour(colour, look),
          width: isBefore ? 1.25 : 1.75,
          alpha: isBefore ? 0.55 : 1,
          dash: [...(isBefore ? DASH_BEFORE : lookOf(look).dash)],
          points: { show: false },
        })),
      ],
      axes: [
        {
          ...axis(),
          size: hasTimes ? TIMES_HEIGHT - MARKS_LANE + lane : NO_TIMES_HEIGHT,
          gap: 5 + lane,
          lineGap: 1.2,
          splits: (self) => {
            const { span } = latest.current;
            const most = self.bbox.width / uPlot.pxRatio / TICK_ROOM;
            ticks = timeTicks(span, most, !hasDate(span.to));
            return ticks.map(({ at }) => at);
          },
          values: () => ticks.map(({ text }) => (hasTimes ? text : '')),
        },
        {
          ...axis(),
          size: 48,
          // Steps are 1, 2 or 5 times a power of ten: room for six gives at least three ticks.
          space: (_self, _i, _a, _b, height) => Math.max(fontPx(), Math.min(34, height / 6)),
          values: (_self, splits) => splits.map(axisText),
        },
      ],
      hooks: {
        drawAxes: [(self) => drawBelow(frameOf(self))],
        draw: [
          (self) => {
            const frame = frameOf(self);
            drawAbove(frame);
            if (!hasTimes) return;
            for (const line of frame.model.lines) drawMarks(frame, line);
          },
        ],
        setCursor: [
          (self) => {
            // Also called for new data, when the mouse may be elsewhere.
            if (!self.over.matches(':hover')) return;
            handlers.onPoint(self.posToVal(self.cursor.left ?? 0, 'x'));
          },
        ],
        setSelect: [
          (self) => {
            const { left, width } = self.select;
            self.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
            if (width < SHORTEST_DRAG) return;
            handlers.onZoom?.({
              from: self.posToVal(left, 'x'),
              to: self.posToVal(left + width, 'x'),
            });
          },
        ],
      },
    },
    aligned(latest.current),
    element,
  );
  chart.over.addEventListener('mouseleave', () => handlers.onPoint(null));
  chart.over.addEventListener('click', (event) => {
    handlers.onPick?.(chart.posToVal(event.offsetX, 'x'));
  });
  return chart;
}

/** `onLook` calls back when a chart's colours change. */
export function usePlot(
  place: RefObject<HTMLDivElement | null>,
  model: PlotModel,
  height: number,
  hasTimes: boolean,
  handlers: PlotHandlers,
  onLook: (listener: () => void, signal: AbortSignal) => void,
): RefObject<uPlot | null> {
  const plot = useRef<uPlot | null>(null);
  const latest = useRef(model);
  const { width } = useSize(place);
  const hasSize = width > 0;
  const looks = drawnOf(model).map(({ look, isBefore }) => [look, isBefore]);
  const shape = JSON.stringify([looks, hasMarks(model)]);
  useLayoutEffect(() => {
    latest.current = model;
  }, [model]);
  useLayoutEffect(() => {
    const element = place.current;
    if (!element || !hasSize) return undefined;
    const chart = build(element, latest, hasTimes, handlers);
    plot.current = chart;
    // At once: a printer does not wait.
    const gone = new AbortController();
    onLook(() => {
      chart.batch(() => chart.redraw());
    }, gone.signal);
    return () => {
      plot.current = null;
      gone.abort();
      chart.destroy();
      handlers.onPoint(null);
    };
  }, [place, shape, hasSize, hasTimes, handlers, onLook]);
  useLayoutEffect(() => {
    const chart = plot.current;
    if (!chart) return;
    if (chart.width !== width || chart.height !== height) chart.setSize({ width, height });
    chart.setData(aligned(model));
  }, [model, width, height, shape, hasTimes]);
  return plot;
}

/** Marks a time, ROS seconds, unless the mouse does; without an event. Null: none. */
export function pointOn(chart: uPlot | null, at: number | null): void {
  if (chart?.over.matches(':hover')) return;
  const left = at === null ? -10 : (chart?.valToPos(at, 'x') ?? -10);
  chart?.setCursor({ left, top: at === null ? -10 : 0 }, false);
}

const TICK_ROOM = 70;
