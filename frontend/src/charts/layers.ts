/** The layers below and above a chart's lines, drawn by functions without state. */
import { valueText } from '../domain/format';
import type { Span } from '../domain/time';
import type { Colours } from '../draw/colours';
import { S } from '../strings';
import { limitsOf, type Line, type PlotModel, pointsOf } from './model';

/** Positions on the canvas, in its own pixels. */
export interface Frame {
  readonly context: CanvasRenderingContext2D;
  readonly box: Readonly<Record<'left' | 'top' | 'width' | 'height', number>>;
  /** Canvas pixels per CSS pixel. */
  readonly ratio: number;
  readonly x: (at: number) => number;
  /** Position of a value in the sensor's own unit. */
  readonly y: (value: number) => number;
  readonly model: PlotModel;
  readonly colour: Colours;
}

/** Closer together than this, markers would hide the line; CSS pixels. */
const MARKER_ROOM = 14;
const MARKER_SIZE = 5;

function clip({ context, box }: Frame): void {
  context.save();
  context.beginPath();
  context.rect(box.left, box.top, box.width, box.height);
  context.clip();
}

export function drawBelow(frame: Frame): void {
  const { context, model } = frame;
  clip(frame);
  drawIdeal(frame);
  drawGaps(frame);
  for (const line of model.lines) drawRanges(frame, line);
  context.restore();
}

function drawIdeal({ context, ratio, x, y, model, colour }: Frame): void {
  context.lineWidth = ratio;
  for (const { from, to, ranges } of model.bands) {
    const [left, right] = [x(from), x(to)];
    const lines = (values: readonly number[]): void => {
      context.beginPath();
      for (const value of values) {
        const edge = Math.round(y(value)) + 0.5;
        context.moveTo(left, edge);
        context.lineTo(right, edge);
      }
      context.stroke();
    };
    const { ideal, critical } = ranges;
    if (!ideal) continue;
    context.fillStyle = colour('chart-ideal');
    context.fillRect(left, y(ideal[1]), right - left, y(ideal[0]) - y(ideal[1]));
    context.strokeStyle = colour('chart-ideal-line');
    context.setLineDash([2 * ratio, 4 * ratio]);
    lines(ideal);
    context.setLineDash([]);
    // Drawn only if the picture reaches it; it gets no room of its own.
    context.strokeStyle = colour('chart-failure');
    lines(critical ?? []);
  }
}

/** Hatched as on the time bar where no line has data, so that a gap does not look like a fault of the page. */
function drawGaps(frame: Frame): void {
  frame.context.strokeStyle = frame.colour('chart-gap');
  frame.context.lineWidth = frame.ratio;
  const all = frame.model.lines.map(({ series }) => series);
  const missing = common(all.map((series) => series.missing));
  hatched(frame, without(common(all.map(({ gaps }) => gaps)), missing), -1);
  // Leaning the other way: whether anything was received is not known.
  hatched(frame, missing, 1);
}

/** The parts of spans that all lists have. */
export const common = (lists: readonly (readonly Span[])[]): readonly Span[] =>
  lists.length === 0 ? [] : lists.reduce((both, other) => without(both, without(both, other)));

/** What is left of spans outside others. */
export const without = (spans: readonly Span[], others: readonly Span[]): readonly Span[] =>
  others.reduce(
    (left, other) =>
      left.flatMap(({ from, to }) =>
        [
          { from, to: Math.min(to, other.from) },
          { from: Math.max(from, other.to), to },
        ].filter((part) => part.to > part.from),
      ),
    spans,
  );

function hatched({ context, box, ratio, x }: Frame, spans: readonly Span[], slant: 1 | -1): void {
  const edges = [box.top + box.height, box.top] as const;
  const [from, to] = slant > 0 ? edges : [edges[1], edges[0]];
  for (const span of spans) {
    const left = Math.max(box.left, x(span.from));
    const width = Math.min(box.left + box.width, x(span.to)) - left;
    if (width < 3 * ratio) continue;
    const step = 9 * ratio;
    context.save();
    context.beginPath();
    context.rect(left, box.top, width, box.height);
    context.clip();
    context.beginPath();
    const first = Math.floor((left - box.height) / step) * step;
    for (let at = first; at < left + width; at += step) {
      context.moveTo(at, from);
      context.lineTo(at + box.height, to);
    }
    context.stroke();
    context.restore();
  }
}

/** From the least to the largest value of each bucket, as wide as the bucket; nothing joins buckets. */
function drawRanges({ context, ratio, x, y, model, colour }: Frame, line: Line): void {
  const { series } = line;
  if (series.bucketS === null) return;
  context.globalAlpha = model.lines.length === 1 ? 0.28 : 0.14;
  context.fillStyle = lineColour(colour, line.look);
  context.beginPath();
  for (const { at, min, max } of series.points) {
    const left = x(at);
    const right = Math.min(x(at + series.bucketS), x(series.to));
    const top = y(max ?? 0);
    const height = Math.max(ratio, y(min ?? 0) - top);
    context.rect(left, top, Math.max(ratio, right - left), height);
  }
  context.fill();
  context.globalAlpha = 1;
}

export function drawAbove(frame: Frame): void {
  const { context, model } = frame;
  // The last line's dashes are still in force.
  context.setLineDash([]);
  clip(frame);
  for (const line of model.lines) drawMarkers(frame, line);
  drawMoment(frame);
  context.restore();
  drawNames(frame);
}

/** Height of a limit's name; CSS pixels. */
const NAME_HEIGHT = 15;
const NAME_GAP = 6;

/**
 * Each limit's name above its line, over the oldest readings, with an arrow if the line lies above or
 * below the picture.
 */
function drawNames({ context, box, ratio, y, model, colour }: Frame): void {
  const height = NAME_HEIGHT * ratio;
  const names = limitsOf(model).sort((a, b) => b.value - a.value);
  context.font = `${fontPx() * ratio}px ${colour('font')}`;
  context.textAlign = 'left';
  context.textBaseline = 'bottom';
  context.lineWidth = 4 * ratio;
  context.strokeStyle = colour('chart-surface');
  let least = box.top + height;
  names.forEach(({ kind, value, side }, index) => {
    const most = box.top + box.height - (names.length - 1 - index) * height;
    const at = Math.max(least, Math.min(y(value), most));
    least = at + height;
    const word = kind === 'ideal' ? S.idealParts.any : S.alarmStatus.critical;
    const text = `${ARROWS[side]}${word} ${valueText(model.sensor, value)}`;
    context.strokeText(text, box.left + NAME_GAP * ratio, at);
    context.fillStyle = kind === 'ideal' ? colour('chart-text') : colour('chart-failure');
    context.fillText(text, box.left + NAME_GAP * ratio, at);
  });
}

const ARROWS = { below: '↓ ', inside: '', above: '↑ ' } as const;

/** A marker for each reading, if there is room; always for a point between two breaks, which has no line. */
function drawMarkers({ context, ratio, x, y, box, model, colour }: Frame, line: Line): void {
  const { marker } = lookOf(line.look);
  const points = pointsOf(line.series);
  const seen = points.filter(
    ({ at, value }) => value !== null && at >= model.span.from && at <= model.span.to,
  );
  const hasRoom = line.series.bucketS === null && seen.length * MARKER_ROOM * ratio <= box.width;
  const stroke = lineColour(colour, line.look);
  context.strokeStyle = stroke;
  context.fillStyle = stroke;
  context.lineWidth = 1.5 * ratio;
  points.forEach(({ at, value }, index) => {
    if (value === null) return;
    const isAlone =
      (points[index - 1]?.value ?? null) === null && (points[index + 1]?.value ?? null) === null;
    if (!hasRoom && !isAlone) return;
    const path = new Path2D(markerPath(marker, x(at), y(value), MARKER_SIZE * ratio));
    if (isStroked(marker)) context.stroke(path);
    else context.fill(path);
  });
}

/** Marks of one kind closer together than this are merged; CSS pixels. */
const MARK_ROOM = 6;
/** Widths of the marks; an inspection is ordinary, and must not outweigh the lines. */
const MARK_SIZES = { inspection: 3, failure: 6 } as const;
/** Height of the marks' own lane, between values and times; CSS pixels. */
export const MARKS_LANE = 24;

export function drawMarks({ context, ratio, x, box, colour }: Frame, { marks }: Line): void {
  const bottom = box.top + box.height;
  context.lineWidth = 1.5 * ratio;
  context.fillStyle = colour('chart-inspection');
  context.strokeStyle = colour('chart-failure');
  for (const kind of ['inspection', 'failure'] as const) {
    const isFailure = kind === 'failure';
    const y = bottom + (isFailure ? 20 : 8) * ratio;
    let last = -Infinity;
    for (const mark of marks) {
      const at = x(mark.at + mark.widthS / 2);
      if (mark.kind !== kind || at - last < MARK_ROOM * ratio) continue;
      last = at;
      const marker = isFailure ? 'cross' : 'circle';
      const path = new Path2D(markerPath(marker, at, y, MARK_SIZES[kind] * ratio));
      if (isFailure) context.stroke(path);
      else context.fill(path);
    }
  }
}

function drawMoment({ context, box, ratio, x, model: { moment }, colour }: Frame): void {
  if (moment === null) return;
  const at = Math.round(x(moment));
  context.strokeStyle = colour('chart-moment');
  context.fillStyle = colour('chart-moment');
  context.lineWidth = 2 * ratio;
  context.beginPath();
  context.moveTo(at, box.top);
  context.lineTo(at, box.top + box.height);
  context.stroke();
  const size = 9 * ratio;
  context.fill(new Path2D(markerPath('down', at, box.top + size / 2, size)));
}

type Marker = 'circle' | 'square' | 'diamond' | 'up' | 'cross' | 'down' | 'plus' | 'ring';

/** Lines differ in colour, dash and marker, so that none of these is needed alone. */
const LOOKS: readonly { readonly dash: readonly number[]; readonly marker: Marker }[] = [
  { dash: [], marker: 'circle' },
  { dash: [8, 4], marker: 'square' },
  { dash: [2, 3], marker: 'diamond' },
  { dash: [12, 3, 2, 3], marker: 'up' },
  { dash: [5, 2], marker: 'cross' },
  { dash: [8, 3, 2, 3, 2, 3], marker: 'down' },
  { dash: [3, 6], marker: 'plus' },
  { dash: [14, 5], marker: 'ring' },
];

/** The style of the line at that place in the list; it keeps it while others are removed. */
export function lookOf(index: number) {
  const colour = index % LOOKS.length;
  const { dash, marker } = LOOKS[colour] ?? { dash: [], marker: 'circle' };
  return { colour, dash, marker };
}

export const lineColour = (colour: Colours, look: number): string =>
  colour(`chart-${lookOf(look).colour + 1}`);

/** Grows with the page's text. */
export const fontPx = (): number => {
  const { fontSize } = getComputedStyle(document.documentElement);
  return Math.round(11.5 * (parseFloat(fontSize) / 16 || 1));
};

/** Outline of a marker around a point; `size` is its width. Filled, except crosses and the ring. */
export function markerPath(marker: Marker, x: number, y: number, size: number): string {
  const r = size / 2;
  const line = (...points: readonly (readonly [number, number])[]): string =>
    `M${points.map(([dx, dy]) => `${x + dx * r} ${y + dy * r}`).join('L')}`;
  switch (marker) {
    case 'circle':
    case 'ring':
      return `M${x - r} ${y}a${r} ${r} 0 1 0 ${size} 0a${r} ${r} 0 1 0 ${-size} 0Z`;
    case 'square':
      return `${line([-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9])}Z`;
    case 'diamond':
      return `${line([0, -1.2], [1.2, 0], [0, 1.2], [-1.2, 0])}Z`;
    case 'up':
      return `${line([0, -1.1], [1.1, 0.9], [-1.1, 0.9])}Z`;
    case 'down':
      return `${line([0, 1.1], [1.1, -0.9], [-1.1, -0.9])}Z`;
    case 'cross':
      return line([-1, -1], [1, 1]) + line([1, -1], [-1, 1]);
    case 'plus':
      return line([-1.2, 0], [1.2, 0]) + line([0, -1.2], [0, 1.2]);
  }
}

export const isStroked = (marker: Marker): boolean =>
  marker === 'cross' || marker === 'plus' || marker === 'ring';
