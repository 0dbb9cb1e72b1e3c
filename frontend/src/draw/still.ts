/** The layers that change only with data or view: ground, SLAM map, heat map, grid, boxes. */
import type { Field } from '../contract/types';
import { written } from '../domain/format';
import { stepsIn } from '../domain/field';
import type { AreaOnMap } from '../domain/table';
import { shown } from '../domain/text';
import {
  boundsOf,
  canvasPoint,
  gridStep,
  lengthText,
  type MapPoint,
  mapPoint,
  toCanvas,
  toMap,
} from '../geometry/coordinates';
import { imageToCanvas, type Placement } from '../geometry/image';
import type { Colours } from './colours';
import { canvasOfPixels, contextOf, newCanvas, type Pen } from './surface';

export function drawGround({ context, size, colour }: Pen): void {
  context.fillStyle = colour('sunken');
  context.fillRect(0, 0, size.width, size.height);
}

/** The greys of /api/map.png, from occupied to free. */
const OCCUPIED_GREY = 70;
const FREE_GREY = 236;
const LEAST_FREE_GREY = (OCCUPIED_GREY + FREE_GREY) / 2;

/** A black picture of the SLAM map, with the opacity that `share` gives for its grey. */
function maskOf({ data, width, height }: ImageData, share: (grey: number) => number) {
  const mask = new Uint8ClampedArray(data.length);
  for (let at = 0; at < data.length; at += 4) {
    mask[at + 3] = (data[at + 3] ?? 0) * share(data[at] ?? 0);
  }
  return canvasOfPixels({ data: mask, width, height });
}

function filled(mask: HTMLCanvasElement, colour: string): HTMLCanvasElement {
  const context = contextOf(mask);
  context.globalCompositeOperation = 'source-in';
  context.fillStyle = colour;
  context.fillRect(0, 0, mask.width, mask.height);
  context.globalCompositeOperation = 'source-over';
  return mask;
}

/** The SLAM map in the theme's colours: greys become mixtures of wall and floor. */
export function tintMap(pixels: ImageData, colour: Colours): HTMLCanvasElement {
  const wall = (grey: number): number =>
    Math.min(1, Math.max(0, (FREE_GREY - grey) / (FREE_GREY - OCCUPIED_GREY)));
  const tinted = filled(
    maskOf(pixels, () => 1),
    colour('floor'),
  );
  contextOf(tinted).drawImage(filled(maskOf(pixels, wall), colour('map-wall')), 0, 0);
  return tinted;
}

/** The floor of the SLAM map: the inside of the greenhouse. */
export const floorOf = (pixels: ImageData): HTMLCanvasElement =>
  maskOf(pixels, (grey) => Number(grey >= LEAST_FREE_GREY));

interface Placed {
  readonly picture: HTMLCanvasElement;
  readonly placement: Placement;
}

/** Unless `isSmooth`, cells stay sharp if they are larger than pixels. */
export function drawPicture(pen: Pen, picture: Placed, isSmooth = false): void {
  place(pen, picture, isSmooth || pen.view.scale * picture.placement.resolution * pen.ratio < 1);
}

function place({ context, view }: Pen, { picture, placement }: Placed, isSmooth = false): void {
  context.save();
  context.transform(...imageToCanvas(placement, view));
  context.imageSmoothingEnabled = isSmooth;
  context.drawImage(picture, 0, 0);
  context.restore();
}

/** A picture of a field's cells at the field's place. */
export function placedField(
  { originX, originY, resolution }: Field,
  picture: HTMLCanvasElement,
): Placed {
  const { width, height } = picture;
  return { picture, placement: { originX, originY, yaw: 0, resolution, width, height } };
}

const GRID_GAP_PX = 56;

function gridTicks({ size, view, textScale }: Pen) {
  const step = gridStep(view.scale, GRID_GAP_PX * textScale);
  const topLeft = toMap(view, canvasPoint(0, 0));
  const bottomRight = toMap(view, canvasPoint(size.width, size.height));
  return {
    columns: multiples(topLeft.x, bottomRight.x, step),
    rows: multiples(bottomRight.y, topLeft.y, step),
  };
}

/** Lines at round metres, far enough apart for their numbers. */
export function drawGridLines(pen: Pen): void {
  const { context, size, view, colour } = pen;
  const { columns, rows } = gridTicks(pen);
  const sharp = (value: number): number => Math.round(value) + 0.5;

  context.strokeStyle = colour('map-grid');
  context.lineWidth = 1;
  context.beginPath();
  for (const x of columns) {
    const at = sharp(view.x + x * view.scale);
    context.moveTo(at, 0);
    context.lineTo(at, size.height);
  }
  for (const y of rows) {
    const at = sharp(view.y - y * view.scale);
    context.moveTo(0, at);
    context.lineTo(size.width, at);
  }
  context.stroke();
}

/** Distance from the edge, where a past moment has a frame, CSS pixels. */
const EDGE_PX = 8;

export function drawGridLabels(pen: Pen): void {
  const { context, size, view, colour, textScale } = pen;
  const { columns, rows } = gridTicks(pen);
  context.fillStyle = colour('map-text');
  context.font = `500 ${10.5 * textScale}px "Inter Variable", system-ui, sans-serif`;
  context.textBaseline = 'top';
  context.textAlign = 'left';
  // The buttons in the upper right corner are in a row on a low or wide map (map.css).
  const isLow = size.height <= 300 || size.width >= 1.5 * size.height;
  const buttons = isLow ? 240 : 96;
  for (const x of columns) {
    const at = view.x + x * view.scale + 4;
    // Clear of the buttons, and of the other axis in the left corner.
    if (at > 30 * textScale && at < size.width - buttons) context.fillText(tick(x), at, EDGE_PX);
  }
  context.textBaseline = 'bottom';
  for (const y of rows) {
    const at = view.y - y * view.scale - 2;
    if (at > 28 * textScale) context.fillText(tick(y), EDGE_PX, at);
  }
}

function multiples(from: number, to: number, step: number): number[] {
  const values: number[] = [];
  for (let i = Math.ceil(from / step); i * step <= to; i++) values.push(i * step);
  return values;
}

const tick = (metres: number): string =>
  (metres < 0 ? '\u2212' : '') +
  (Math.abs(metres) < 1e-9 ? '0' : written(lengthText(Math.abs(metres)))).replace('\u00a0', ' ');

export function drawBoxes(
  { context, view, colour }: Pen,
  boxes: readonly (readonly MapPoint[])[],
): void {
  context.fillStyle = colour('map-box');
  context.strokeStyle = colour('map-box-line');
  context.lineWidth = 1.25;
  context.beginPath();
  for (const box of boxes) {
    box.forEach((corner, index) => {
      const { x, y } = toCanvas(view, corner);
      if (index === 0) context.moveTo(x, y);
      else context.lineTo(x, y);
    });
    context.closePath();
  }
  context.fill();
  context.stroke();
}

/** Margin of an area around its tags, m. */
const AREA_M = 0.25;

export function drawAreas(
  { context, view, colour, textScale }: Pen,
  areas: readonly AreaOnMap[],
): void {
  if (areas.length === 0) return;
  context.strokeStyle = context.fillStyle = colour('map-text');
  context.lineWidth = 1.25;
  context.setLineDash([6, 4]);
  context.font = `600 ${11 * textScale}px "Inter Variable", system-ui, sans-serif`;
  context.textBaseline = 'bottom';
  context.textAlign = 'left';
  const names: [string, number, number][] = [];
  for (const { name, places } of areas) {
    const box = boundsOf(places);
    if (!box) continue;
    const { x, y } = toCanvas(view, mapPoint(box.minX - AREA_M, box.maxY + AREA_M));
    names.push([shown(name, 24), x, y - 3]);
    const [width, height] = [box.maxX - box.minX, box.maxY - box.minY];
    context.strokeRect(x, y, (width + 2 * AREA_M) * view.scale, (height + 2 * AREA_M) * view.scale);
  }
  context.setLineDash([]);
  // A halo, as the line may cross a heat map or another area.
  context.lineWidth = 4;
  context.strokeStyle = colour('sunken');
  for (const [name, x, y] of names) {
    context.strokeText(name, x, y);
    context.fillText(name, x, y);
  }
}

/** Distance between strokes of the hatching, CSS pixels. */
const GAP_PX = 9;
/** The same for growing errors: each hatching contains all strokes of the previous one. */
const UNSURE_GAPS_PX = [18, 9, 4.5] as const;

/** The cells of a field for which `isIn` holds, top row first. */
export function cellsOf(
  { width, height }: Field,
  isIn: (cell: number) => boolean,
): HTMLCanvasElement {
  const data = new Uint8ClampedArray(width * height * 4);
  for (let cell = 0; cell < width * height; cell++) {
    const row = height - 1 - Math.floor(cell / width);
    if (isIn(cell)) data[(row * width + (cell % width)) * 4 + 3] = 255;
  }
  return canvasOfPixels({ data, width, height });
}

const isKnown =
  ({ values }: Field) =>
  (cell: number): boolean =>
    !Number.isNaN(values[cell]);

export const knownOf = (field: Field): HTMLCanvasElement => cellsOf(field, isKnown(field));

/** The cells that are hatched over their colours: `old` ones, or those of an unsure estimate. */
export function hatchedOf(field: Field, old: Uint8Array | null) {
  const known = isKnown(field);
  const steps = old ?? (field.sureness && stepsIn(field.sureness));
  return (old ? [GAP_PX] : UNSURE_GAPS_PX).flatMap((gap, index) => {
    const isIn = (cell: number): boolean => steps?.[cell] === index + 1 && known(cell);
    return steps?.includes(index + 1) ? [{ gap, cells: cellsOf(field, isIn) }] : [];
  });
}

/** Reuses one canvas for cutting out the hatching. */
export class Hatching {
  #canvas: HTMLCanvasElement | null = null;

  /** Hatches what `inside` covers and `known` does not. */
  draw(pen: Pen, inside: Placed, known: Placed | null, gap = GAP_PX): void {
    const { size, ratio } = pen;
    const width = Math.max(1, Math.round(size.width * ratio));
    const height = Math.max(1, Math.round(size.height * ratio));
    if (this.#canvas?.width !== width || this.#canvas.height !== height) {
      this.#canvas = newCanvas(width, height);
    }
    const context = contextOf(this.#canvas);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.globalCompositeOperation = 'source-over';
    context.clearRect(0, 0, size.width, size.height);
    const own = { ...pen, context };
    strokes(own, gap);
    context.globalCompositeOperation = 'destination-in';
    place(own, inside);
    if (known) {
      context.globalCompositeOperation = 'destination-out';
      place(own, known);
    }
    pen.context.drawImage(this.#canvas, 0, 0, size.width, size.height);
  }
}

function strokes({ context, size, view, colour }: Pen, gap: number): void {
  const { width, height } = size;
  const first = ((view.x + view.y) % gap) - gap;
  context.strokeStyle = colour('map-hatch');
  context.lineWidth = 1;
  context.beginPath();
  for (let x = first; x < width + height + gap; x += gap) {
    context.moveTo(x, 0);
    context.lineTo(x - height, height);
  }
  context.stroke();
}

export function drawEdges({ context, size, view, colour }: Pen, lines: readonly number[]): void {
  context.strokeStyle = colour('map-edge');
  context.lineWidth = 1.25;
  context.beginPath();
  for (let at = 0; at < lines.length; at += 4) {
    const from = toCanvas(view, mapPoint(lines[at] ?? 0, lines[at + 1] ?? 0));
    const to = toCanvas(view, mapPoint(lines[at + 2] ?? 0, lines[at + 3] ?? 0));
    const corner = canvasPoint(Math.min(from.x, to.x), Math.min(from.y, to.y));
    if (corner.x > size.width || corner.y > size.height) continue;
    if (Math.max(from.x, to.x) < 0 || Math.max(from.y, to.y) < 0) continue;
    context.moveTo(from.x, from.y);
    context.lineTo(to.x, to.y);
  }
  context.stroke();
}
