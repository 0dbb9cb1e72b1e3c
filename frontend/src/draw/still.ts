/** What changes only with the data or the view: ground, SLAM map, heat map, grid, boxes. */
import type { Field } from '../contract/types';
import { written } from '../domain/format';
import { mix, rgbText } from '../domain/ramp';
import { canvasPoint, toCanvas, toMap, type MapPoint, type View } from '../geometry/coordinates';
import { imageToCanvas, type Placement } from '../geometry/image';
import { gridStep, lengthText } from '../geometry/scale';
import type { Palette } from './palette';
import { canvasOfPixels, type Surface } from './surface';

export function drawGround({ context, size }: Surface, palette: Palette): void {
  context.fillStyle = rgbText(palette.ground);
  context.fillRect(0, 0, size.width, size.height);
}

/** The greys of /api/map.png between which a cell lies, from occupied to free. */
const OCCUPIED_GREY = 70;
const FREE_GREY = 236;
/** Lighter is floor. */
export const LEAST_FREE_GREY = (OCCUPIED_GREY + FREE_GREY) / 2;

/** The SLAM map in the theme's colours: its grey becomes the way from wall to floor. */
export function tintMap(pixels: ImageData, palette: Palette): HTMLCanvasElement {
  const source = pixels.data;
  const data = new Uint8ClampedArray(source.length);
  const tones = Array.from({ length: 256 }, (_, grey) => {
    const free = (grey - OCCUPIED_GREY) / (FREE_GREY - OCCUPIED_GREY);
    return mix(palette.wall, palette.floor, Math.min(1, Math.max(0, free)));
  });
  for (let i = 0; i < source.length; i += 4) {
    const alpha = source[i + 3] ?? 0;
    if (alpha === 0) continue;
    const tone = tones[source[i] ?? 0] ?? palette.floor;
    data[i] = tone[0];
    data[i + 1] = tone[1];
    data[i + 2] = tone[2];
    data[i + 3] = alpha;
  }
  return canvasOfPixels({ data, width: pixels.width, height: pixels.height });
}

/** Draws a picture that lies in the map, cell for cell and never blurred. */
export function drawPicture(
  { context, ratio }: Surface,
  view: View,
  picture: HTMLCanvasElement,
  placement: Placement,
): void {
  const [a, b, c, d, e, f] = imageToCanvas(placement, view);
  context.save();
  context.transform(a, b, c, d, e, f);
  context.imageSmoothingEnabled = view.scale * placement.resolution * ratio < 1;
  context.drawImage(picture, 0, 0);
  context.restore();
}

export function fieldPlacement(field: Field, picture: HTMLCanvasElement): Placement {
  const detail = picture.width / Math.max(1, field.width);
  return {
    originX: field.originX,
    originY: field.originY,
    yaw: 0,
    resolution: field.resolution / detail,
    width: picture.width,
    height: picture.height,
  };
}

const GRID_GAP_PX = 56;

interface GridTicks {
  readonly columns: readonly number[];
  readonly rows: readonly number[];
}

/** Round metres within the surface. */
function gridTicks({ size }: Surface, view: View, textScale: number): GridTicks {
  const step = gridStep(view.scale, GRID_GAP_PX * textScale);
  const topLeft = toMap(view, canvasPoint(0, 0));
  const bottomRight = toMap(view, canvasPoint(size.width, size.height));
  return {
    columns: multiples(topLeft.x, bottomRight.x, step),
    rows: multiples(bottomRight.y, topLeft.y, step),
  };
}

/** Lines at round metres, so far apart that their numbers have room. */
export function drawGridLines(surface: Surface, view: View, palette: Palette, textScale = 1): void {
  const { context, size } = surface;
  const { columns, rows } = gridTicks(surface, view, textScale);
  const sharp = (value: number): number => Math.round(value) + 0.5;

  context.strokeStyle = palette.gridLine;
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

/** Clear of the frame that the past has, CSS pixels. */
const EDGE_PX = 8;

/** The grid's numbers, along the left and the upper edge of the view. */
export function drawGridLabels(
  surface: Surface,
  view: View,
  palette: Palette,
  textScale = 1,
): void {
  const { context, size } = surface;
  const { columns, rows } = gridTicks(surface, view, textScale);
  context.fillStyle = palette.gridText;
  context.font = `500 ${10.5 * textScale}px "Inter Variable", system-ui, sans-serif`;
  context.textBaseline = 'top';
  context.textAlign = 'left';
  for (const x of columns) {
    const at = view.x + x * view.scale + 4;
    // The buttons are in the upper right corner, the other axis begins in the left one.
    if (at > 30 * textScale && at < size.width - 96) context.fillText(tick(x), at, EDGE_PX);
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

/** Outlines of the planter boxes; several tags of one box draw it once. */
export function drawBoxes(
  { context }: Surface,
  view: View,
  boxes: readonly (readonly MapPoint[])[],
  palette: Palette,
): void {
  context.fillStyle = palette.boxFill;
  context.strokeStyle = palette.boxLine;
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
