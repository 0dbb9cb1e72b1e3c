import type { Size, View } from '../geometry/coordinates';
import type { Colours } from './colours';

/** A canvas ready to draw on in CSS pixels. */
export interface Surface {
  readonly context: CanvasRenderingContext2D;
  readonly size: Size;
  /** Device pixels per CSS pixel. */
  readonly ratio: number;
}

/** Everything needed to draw on the map. */
export interface Pen extends Surface {
  readonly view: View;
  readonly colour: Colours;
  readonly sprites: Sprites;
  /** Scale of the page's text, usually 1. */
  readonly textScale: number;
}

export function newCanvas(width: number, height: number): HTMLCanvasElement {
  const canvas = document.createElement('canvas');
  canvas.width = Math.max(1, Math.round(width));
  canvas.height = Math.max(1, Math.round(height));
  return canvas;
}

export function contextOf(canvas: HTMLCanvasElement): CanvasRenderingContext2D {
  const context = canvas.getContext('2d');
  if (!context) throw new Error('this browser has no 2d canvas');
  return context;
}

export function clear({ context, size, ratio }: Surface): void {
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.globalAlpha = 1;
  context.clearRect(0, 0, size.width, size.height);
}

export function canvasOfPixels(
  pixels: Pick<ImageData, 'data' | 'width' | 'height'>,
): HTMLCanvasElement {
  const canvas = newCanvas(pixels.width, pixels.height);
  if (pixels.width > 0 && pixels.height > 0) {
    contextOf(canvas).putImageData(new ImageData(pixels.data, pixels.width, pixels.height), 0, 0);
  }
  return canvas;
}

const MOST_SPRITES = 1_000;

/**
 * Small pictures, painted once and then copied: without a GPU a copy is many times cheaper than a
 * path. Emptied when full, so that a page open for days stays small.
 */
export class Sprites {
  readonly #sprites = new Map<string, HTMLCanvasElement>();

  constructor(private readonly ratio: number) {}

  get(
    key: string,
    width: number,
    height: number,
    paint: (context: CanvasRenderingContext2D) => void,
  ): HTMLCanvasElement {
    const known = this.#sprites.get(key);
    if (known) return known;
    if (this.#sprites.size >= MOST_SPRITES) this.#sprites.clear();
    const sprite = newCanvas(Math.ceil(width) * this.ratio, Math.ceil(height) * this.ratio);
    const context = contextOf(sprite);
    context.scale(this.ratio, this.ratio);
    paint(context);
    this.#sprites.set(key, sprite);
    return sprite;
  }

  /** Copies a sprite with its top left corner at (x, y) CSS pixels, on whole device pixels. */
  draw({ context, ratio }: Surface, sprite: HTMLCanvasElement, x: number, y: number): void {
    context.drawImage(
      sprite,
      Math.round(x * ratio) / ratio,
      Math.round(y * ratio) / ratio,
      sprite.width / ratio,
      sprite.height / ratio,
    );
  }
}

/** Pixels drawn beyond each edge while the view moves. */
const MARGIN_PX = 160;

/**
 * Makes panning cheap: while only the position of a view changes, a layer is drawn once with a margin
 * and then shifted. A still view is drawn directly, without a copy.
 */
export class PanBuffer {
  #canvas: HTMLCanvasElement | null = null;
  /** The view in the buffer, in its own pixels; null: nothing usable. */
  #held: View | null = null;
  #last: View | null = null;

  /** Invalidates the buffer: the data, the theme or the size has changed. */
  spoil(): void {
    this.#held = null;
  }

  draw(pen: Pen, paint: (pen: Pen) => void): void {
    const { context, ratio, view } = pen;
    const last = this.#last;
    this.#last = view;
    const isPan = last?.scale === view.scale && (last.x !== view.x || last.y !== view.y);
    if (!isPan) {
      this.#held = null;
      paint(pen);
      return;
    }
    const shift = this.#shiftTo(view) ?? this.#hold(pen, paint);
    if (!this.#canvas) return;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this.#canvas, Math.round(shift.x * ratio), Math.round(shift.y * ratio));
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  /** Position of the buffer's corner for a view; null if the buffer does not cover it. */
  #shiftTo(view: View): { x: number; y: number } | null {
    if (this.#held?.scale !== view.scale) return null;
    const x = view.x - this.#held.x;
    const y = view.y - this.#held.y;
    const isCovered = x <= 0 && y <= 0 && x >= -2 * MARGIN_PX && y >= -2 * MARGIN_PX;
    return isCovered ? { x, y } : null;
  }

  #hold(pen: Pen, paint: (pen: Pen) => void): { x: number; y: number } {
    const { size, ratio, view } = pen;
    const width = size.width + 2 * MARGIN_PX;
    const height = size.height + 2 * MARGIN_PX;
    const wanted = newCanvas(width * ratio, height * ratio);
    if (this.#canvas?.width !== wanted.width || this.#canvas.height !== wanted.height) {
      this.#canvas = wanted;
    }
    const held = { ...view, x: view.x + MARGIN_PX, y: view.y + MARGIN_PX };
    const own = { ...pen, context: contextOf(this.#canvas), size: { width, height }, view: held };
    clear(own);
    paint(own);
    this.#held = held;
    return { x: -MARGIN_PX, y: -MARGIN_PX };
  }
}
