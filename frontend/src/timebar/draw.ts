/** Draws the bar. Each mark has a shape and a place of its own; colour comes on top. */
import type { Tick, Timeline } from '../domain/timeline';
import { clear, hatch, type Surface } from '../draw/surface';
import {
  type Axis,
  beforeMemory,
  type Column,
  runStarts,
  type Stretch,
  stretchesOf,
  xOf,
} from './axis';

/** Heights from the top, CSS pixels: marks of pests, bars of scans, bars of failures, times. */
const MARKS_PX = 14;
const SCANS_PX = 24;
const FAILURES_PX = 8;
const TICKS_PX = 16;
export const BAR_PX = MARKS_PX + SCANS_PX + FAILURES_PX + TICKS_PX;

const BASE_PX = MARKS_PX + SCANS_PX;
const FLOOR_PX = BASE_PX + FAILURES_PX;
const HATCH_PX = 6;
const MARK_WIDTH_PX = 10;

interface Bar {
  readonly axis: Axis;
  /** Null: it has not come yet. */
  readonly timeline: Timeline | null;
  readonly columns: readonly Column[];
  readonly ticks: readonly Tick[];
}

export function drawBar(surface: Surface, bar: Bar, palette: BarPalette): void {
  const { context } = surface;
  const { axis, timeline } = bar;
  clear(surface);
  context.save();
  const before = timeline && beforeMemory(timeline, axis);
  if (before) hatched(context, before, palette.line, 1);
  for (const missing of stretchesOf(timeline?.missing ?? [], axis)) {
    hatched(context, missing, palette.line, 1);
  }
  for (const silence of stretchesOf(timeline?.silences ?? [], axis)) {
    hatched(context, silence, palette.silence, -1);
  }
  drawTicks(context, bar, palette);
  context.strokeStyle = palette.muted;
  context.lineWidth = 1;
  line(context, 0, BASE_PX + 0.5, axis.width, BASE_PX + 0.5);
  drawColumns(context, bar.columns, axis.width, palette);
  for (const x of timeline ? runStarts(timeline, axis) : []) drawRunStart(context, x, palette);
  context.restore();
}

function hatched(
  context: CanvasRenderingContext2D,
  { x, width }: Stretch,
  colour: string,
  slant: 1 | -1,
): void {
  context.strokeStyle = colour;
  context.lineWidth = 1.5;
  hatch(context, x, MARKS_PX, { width, height: SCANS_PX + FAILURES_PX }, HATCH_PX, slant);
}

function drawTicks(context: CanvasRenderingContext2D, bar: Bar, palette: BarPalette): void {
  const { axis, ticks } = bar;
  context.font = palette.font;
  context.textBaseline = 'alphabetic';
  context.strokeStyle = palette.line;
  context.lineWidth = 1;
  context.fillStyle = palette.muted;
  let free = 0;
  for (const { at, text } of ticks) {
    const x = Math.round(xOf(axis, at)) + 0.5;
    line(context, x, MARKS_PX, x, FLOOR_PX + 3);
    // The date stands beside the first time of a day.
    const [time = '', day] = text.split('\n');
    const label = day === undefined ? time : `${day} ${time}`;
    const { width } = context.measureText(label);
    const left = Math.min(axis.width - width, Math.max(0, x - width / 2));
    if (left < free) continue;
    context.fillText(label, left, BAR_PX - 3);
    free = left + width + 10;
  }
}

function drawColumns(
  context: CanvasRenderingContext2D,
  columns: readonly Column[],
  axisWidth: number,
  palette: BarPalette,
): void {
  for (const { x, width, scanHeight, failureHeight } of columns) {
    const inner = Math.max(1, width - 1);
    if (scanHeight > 0) {
      context.fillStyle = palette.scan;
      context.fillRect(
        x,
        BASE_PX - scanHeight * (SCANS_PX - 2),
        inner,
        scanHeight * (SCANS_PX - 2),
      );
    }
    if (failureHeight > 0) {
      context.fillStyle = palette.failure;
      context.fillRect(x, BASE_PX + 1, inner, Math.max(3, failureHeight * (FAILURES_PX - 1)));
    }
  }
  // Where they have no room beside each other, that which needs somebody stays.
  const taken: number[] = [];
  for (const [kind, draw] of [
    ['pests_seen', drawPest],
    ['pests_cleared', drawCleared],
  ] as const) {
    for (const { x, width, [kind]: count } of columns) {
      // Whole, also at the end of the bar.
      const middle = Math.min(x + width / 2, axisWidth - 5);
      if (count === 0 || taken.some((at) => Math.abs(at - middle) < MARK_WIDTH_PX)) continue;
      taken.push(middle);
      draw(context, middle, palette);
    }
  }
}

function drawPest(context: CanvasRenderingContext2D, x: number, palette: BarPalette): void {
  context.beginPath();
  context.moveTo(x - 5, 2.5);
  context.lineTo(x + 5, 2.5);
  context.lineTo(x, MARKS_PX - 2);
  context.closePath();
  context.fillStyle = palette.pest;
  context.fill();
  context.strokeStyle = palette.surface;
  context.lineWidth = 1;
  context.stroke();
}

function drawCleared(context: CanvasRenderingContext2D, x: number, palette: BarPalette): void {
  context.beginPath();
  context.arc(x, MARKS_PX / 2, 4, 0, 2 * Math.PI);
  context.fillStyle = palette.surface;
  context.fill();
  context.strokeStyle = palette.cleared;
  context.lineWidth = 2;
  context.stroke();
}

function drawRunStart(context: CanvasRenderingContext2D, x: number, palette: BarPalette): void {
  context.save();
  context.strokeStyle = palette.ink;
  context.lineWidth = 1.5;
  context.setLineDash([4, 3]);
  line(context, x, 0, x, FLOOR_PX);
  context.restore();
}

function line(
  context: CanvasRenderingContext2D,
  x: number,
  y: number,
  toX: number,
  toY: number,
): void {
  context.beginPath();
  context.moveTo(x, y);
  context.lineTo(toX, toY);
  context.stroke();
}

/** The bar's colours: a name in the style sheet, and a system's own where those are forced. */
const COLOURS = {
  ink: ['ink', 'CanvasText'],
  muted: ['muted', 'CanvasText'],
  line: ['line', 'GrayText'],
  scan: ['bar-scan', 'CanvasText'],
  failure: ['critical', 'Highlight'],
  pest: ['critical', 'Highlight'],
  cleared: ['healthy', 'CanvasText'],
  silence: ['line-strong', 'GrayText'],
  surface: ['surface', 'Canvas'],
} as const;

export type BarPalette = Readonly<Record<keyof typeof COLOURS | 'font', string>>;

/** As they are now: light or dark, forced, or for paper. */
export function readBarPalette(): BarPalette {
  const style = getComputedStyle(document.documentElement);
  const isForced = window.matchMedia('(forced-colors: active)').matches;
  const textPx = 11 * (parseFloat(style.fontSize) / 16 || 1);
  const colours = Object.entries(COLOURS).map(([name, [own, forced]]) => [
    name,
    isForced ? forced : style.getPropertyValue(`--${own}`).trim(),
  ]);
  return {
    ...(Object.fromEntries(colours) as BarPalette),
    font: `${textPx}px ${style.getPropertyValue('--font') || 'sans-serif'}`,
  };
}
