/** What is not known, and where it begins: hatched inside the house, outlined at its edge. */
import type { Field, Sureness } from '../contract/types';
import { stepsIn } from '../domain/sureness';
import { canvasPoint, mapPoint, toCanvas, type View } from '../geometry/coordinates';
import { imageToCanvas, type Placement } from '../geometry/image';
import type { Palette } from './palette';
import { canvasOfPixels, contextOf, newCanvas, type Surface } from './surface';

/** From stroke to stroke of the hatching, pixels of the page. */
const GAP_PX = 9;
/** The same over what is known ever less surely: each has all strokes of the one before it. */
const UNSURE_GAPS_PX = [18, 9, 4.5] as const;

/** A picture that lies in the map, of which only what it covers counts. */
export interface Mask {
  readonly picture: HTMLCanvasElement;
  readonly placement: Placement;
}

/** The floor of the SLAM map: what is inside the house. `free` is the least grey that is no wall. */
export function floorOf(pixels: ImageData, free: number): HTMLCanvasElement {
  const { data, width, height } = pixels;
  const floor = new Uint8ClampedArray(data.length);
  for (let at = 0; at < data.length; at += 4) {
    if ((data[at + 3] ?? 0) > 0 && (data[at] ?? 0) >= free) floor[at + 3] = 255;
  }
  return canvasOfPixels({ data: floor, width, height });
}

/** The cells of a field that are known, top row first. */
export function knownOf({ width, height, values }: Field): HTMLCanvasElement {
  const data = new Uint8ClampedArray(width * height * 4);
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      if (Number.isNaN(values[y * width + x])) continue;
      data[((height - 1 - y) * width + x) * 4 + 3] = 255;
    }
  }
  return canvasOfPixels({ data, width, height });
}

/**
 * The cells of each step of being unsure, top row first, from the first that is hatched to the last that
 * is still known; null: none is so.
 */
export function unsureOf(field: Field, sureness: Sureness): (HTMLCanvasElement | null)[] {
  const steps = stepsIn(sureness);
  const { values, width, height } = field;
  return UNSURE_GAPS_PX.map((_, index) => {
    const isIt = steps.map((step, cell) =>
      Number(step === index + 1 && !isNaN(values[cell] ?? NaN)),
    );
    if (!isIt.includes(1)) return null;
    return knownOf({
      ...field,
      values: Float32Array.from(isIt, (is) => (is ? 1 : NaN)),
      width,
      height,
    });
  });
}

/** Keeps the one canvas that the hatching is cut out on. */
export class Hatching {
  #canvas: HTMLCanvasElement | null = null;

  /** Hatches all that `inside` covers and `known` does not. */
  draw(
    surface: Surface,
    view: View,
    inside: Mask,
    known: Mask | null,
    palette: Palette,
    gap = GAP_PX,
  ): void {
    const { size, ratio } = surface;
    const width = Math.max(1, Math.round(size.width * ratio));
    const height = Math.max(1, Math.round(size.height * ratio));
    if (this.#canvas?.width !== width || this.#canvas.height !== height) {
      this.#canvas = newCanvas(width, height);
    }
    const context = contextOf(this.#canvas);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.globalCompositeOperation = 'source-over';
    context.clearRect(0, 0, size.width, size.height);
    strokes({ context, size, ratio }, view, palette, gap);
    context.globalCompositeOperation = 'destination-in';
    cut(context, view, inside);
    if (known) {
      context.globalCompositeOperation = 'destination-out';
      cut(context, view, known);
    }
    surface.context.drawImage(this.#canvas, 0, 0, size.width, size.height);
  }
}

/** Hatches what an estimate is unsure of, the denser the less it is sure. */
export function drawUnsure(
  surface: Surface,
  view: View,
  steps: readonly (Mask | null)[],
  hatching: Hatching,
  palette: Palette,
): void {
  UNSURE_GAPS_PX.forEach((gap, index) => {
    const step = steps[index];
    if (step) hatching.draw(surface, view, step, null, palette, gap);
  });
}

/** Diagonals that move with the map. */
function strokes({ context, size }: Surface, view: View, palette: Palette, gap: number): void {
  const { width, height } = size;
  const first = ((view.x + view.y) % gap) - gap;
  context.strokeStyle = palette.hatch;
  context.lineWidth = 1;
  context.beginPath();
  for (let x = first; x < width + height + gap; x += gap) {
    context.moveTo(x, 0);
    context.lineTo(x - height, height);
  }
  context.stroke();
}

function cut(context: CanvasRenderingContext2D, view: View, { picture, placement }: Mask): void {
  const [a, b, c, d, e, f] = imageToCanvas(placement, view);
  context.save();
  context.transform(a, b, c, d, e, f);
  context.imageSmoothingEnabled = false;
  context.drawImage(picture, 0, 0);
  context.restore();
}

/** The lines of `edgesOf`. */
export function drawEdges(
  { context, size }: Surface,
  view: View,
  lines: readonly number[],
  palette: Palette,
): void {
  context.strokeStyle = palette.edge;
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
