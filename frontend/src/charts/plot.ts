/** One chart on the page: uPlot with the layers of `layers.ts`. */
import { type RefObject, useEffect, useLayoutEffect, useRef } from 'react';
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
import { aligned, drawnOf, hasMarks, limitsOf, valueRange, type PlotModel } from './model';

export interface PlotHandlers {
  /** The time under the mouse, ROS seconds; null: none. */
  readonly onPoint: (at: number | null) => void;
  readonly onPick?: (at: number) => void;
  readonly onZoom?: (span: Span) => void;
}

interface PlotSize {
  readonly width: number;
  readonly height: number;
  /** Whether times and marks are below it: in a stack of charts, the last has them for all. */
  readonly hasTimes: boolean;
}

/** Height of the times and the lane of marks, CSS pixels. */
export const TIMES_HEIGHT = 44 + MARKS_LANE;
const NO_TIMES_HEIGHT = 8;
/** Dashes of the day before: stroke and pause, CSS pixels. */
const DASH_BEFORE = [3, 3];
/** A shorter drag is a click, CSS pixels. */
const SHORTEST_DRAG = 6;
/** Room for the names of limits right of the plot, in font sizes. */
const LIMITS_ROOM = 8;
/** Room right of the plot for half of the last time below it, in font sizes. */
const HALF_A_TIME = 2;
/** All charts share one cursor. */
const SYNC_KEY = 'lupin-charts';
/** In the page's language, while uPlot uses the browser's; with all digits of a small step. */
const AXIS_NUMBER = new Intl.NumberFormat(LOCALE, { maximumSignificantDigits: 9 });

export const axisText = (value: number): string => AXIS_NUMBER.format(value).replace('-', '\u2212');

type Plot = ReturnType<typeof createPlot>;

function createPlot(element: HTMLElement, handlers: PlotHandlers) {
  const colour = coloursOf(element);
  let model: PlotModel | null = null;
  let chart: uPlot | null = null;
  let shape = '';
  let ticks: readonly Tick[] = [];

  const frameOf = (u: uPlot, model: PlotModel): Frame => ({
    context: u.ctx,
    box: u.bbox,
    ratio: uPlot.pxRatio,
    x: (at) => u.valToPos(at, 'x', true),
    y: (value) => u.valToPos(toShown(model.sensor, value), 'y', true),
    model,
    colour,
  });

  const axis = (): Partial<uPlot.Axis> => ({
    stroke: () => colour('chart-text'),
    grid: { stroke: () => colour('chart-grid'), width: 1 },
    ticks: { stroke: () => colour('chart-grid'), width: 1, size: 5 },
    font: `${fontPx()}px ${colour('font')}`,
  });

  const build = (first: PlotModel, { hasTimes, ...size }: PlotSize): uPlot => {
    const lane = hasMarks(first) ? MARKS_LANE : 0;
    const u = new uPlot(
      {
        ...size,
        class: 'plot',
        legend: { show: false },
        padding: [8, (hasNames(first) ? LIMITS_ROOM : HALF_A_TIME) * fontPx(), 0, 0],
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
            range: () => [model?.span.from ?? 0, model?.span.to ?? 1],
          },
          y: { range: () => (model ? valueRange(model) : [0, 1]) },
        },
        series: [
          {},
          ...drawnOf(first).map(({ look, isBefore }) => ({
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
              ticks = ticksOf(model, self.bbox.width / uPlot.pxRatio);
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
          drawAxes: [
            (self) => {
              if (model) drawBelow(frameOf(self, model));
            },
          ],
          draw: [
            (self) => {
              if (!model) return;
              const frame = frameOf(self, model);
              drawAbove(frame);
              if (!hasTimes) return;
              for (const line of model.lines) drawMarks(frame, line);
            },
          ],
          setCursor: [
            (self) => {
              const { left } = self.cursor;
              handlers.onPoint(left === undefined || left < 0 ? null : self.posToVal(left, 'x'));
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
      aligned(first),
      element,
    );
    u.over.addEventListener('click', (event) => {
      handlers.onPick?.(u.posToVal(event.offsetX, 'x'));
    });
    return u;
  };

  const colourOf = (_: uPlot, series: number): string => {
    const look = (model && drawnOf(model)[series - 1]?.look) ?? 0;
    return lineColour(colour, look);
  };

  /** The point of the reading valid then, or of the bucket, as in the value beside the chart. */
  const heldIndex = (u: uPlot, series: number, nearest: number, at: number): number => {
    const drawn = model && drawnOf(model)[series - 1];
    const [times, values] = [u.data[0], u.data[series]];
    if (!drawn || !values) return nearest;
    // A bucket's point is at its middle.
    const last = at + (drawn.series.bucketS ?? 0) / 2;
    return times.findLastIndex((time, index) => time <= last && values[index] !== undefined);
  };

  return {
    show: (next: PlotModel, size: PlotSize): void => {
      const before = model;
      model = next;
      const nextShape = drawnOf(next)
        .map(({ look, isBefore }) => `${look}${isBefore ? 'b' : ''}`)
        .join()
        .concat(hasMarks(next) ? ' marks' : '', size.hasTimes ? ' times' : '')
        .concat(hasNames(next) ? ' names' : '');
      if (!chart || shape !== nextShape) {
        chart?.destroy();
        chart = build(next, size);
        shape = nextShape;
        return;
      }
      if (chart.width !== size.width || chart.height !== size.height) chart.setSize(size);
      if (before !== next) chart.setData(aligned(next));
    },
    /** Marks a time, ROS seconds, as the mouse would, but without an event; null: none. */
    point: (at: number | null): void => {
      const left = at === null ? -10 : (chart?.valToPos(at, 'x') ?? -10);
      chart?.setCursor({ left, top: at === null ? -10 : 0 }, false);
    },
    /** Redraws at once in the current colours: a printer does not wait. */
    recolour: (): void => {
      chart?.batch(() => {
        chart?.redraw();
      });
    },
    destroy: (): void => {
      chart?.destroy();
      chart = null;
    },
  };
}

/** A single line always has room for names, so that stacked charts align in time. */
const hasNames = (model: PlotModel): boolean =>
  model.lines.length === 1 || limitsOf(model).length > 0;

/** `onLook` calls back when a chart's colours change. */
export function usePlot(
  place: RefObject<HTMLDivElement | null>,
  model: PlotModel,
  height: number,
  hasTimes: boolean,
  handlers: PlotHandlers,
  onLook: (listener: () => void) => () => void,
): RefObject<Plot | null> {
  const plot = useRef<Plot | null>(null);
  const { width } = useSize(place);
  useLayoutEffect(() => {
    const element = place.current;
    if (!element) return undefined;
    const mine = createPlot(element, handlers);
    plot.current = mine;
    const stop = onLook(mine.recolour);
    return () => {
      plot.current = null;
      stop();
      mine.destroy();
      handlers.onPoint(null);
    };
  }, [place, handlers, onLook]);
  useEffect(() => {
    if (width > 0) plot.current?.show(model, { width, height, hasTimes });
  }, [model, width, height, hasTimes]);
  return plot;
}

const TICK_ROOM = 70;

const ticksOf = (model: PlotModel | null, width: number): readonly Tick[] =>
  model ? timeTicks(model.span, width / TICK_ROOM, !hasDate(model.span.to)) : [];
