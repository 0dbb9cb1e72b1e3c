import type { View } from '../geometry/coordinates';
import { clear, contextOf, newCanvas, type Surface } from './surface';

/** Pixels drawn beyond each edge while the view moves. */
const MARGIN_PX = 160;

/**
 * Makes panning cheap: while only the place of a view changes, a layer is drawn once with a
 * margin around it and then only shifted. A still view is drawn directly, without a copy.
 */
export class PanBuffer {
  #canvas: HTMLCanvasElement | null = null;
  /** The view that the buffer shows, in the buffer's own pixels; null: nothing of use. */
  #held: View | null = null;
  #last: View | null = null;

  /** Drops what is held: the data, the theme or the size has changed. */
  spoil(): void {
    this.#held = null;
  }

  draw(surface: Surface, view: View, paint: (surface: Surface, view: View) => void): void {
    const last = this.#last;
    this.#last = view;
    const isPan = last?.scale === view.scale && (last.x !== view.x || last.y !== view.y);
    if (!isPan) {
      this.#held = null;
      paint(surface, view);
      return;
    }
    const shift = this.#shiftTo(view) ?? this.#hold(surface, view, paint);
    if (!this.#canvas) return;
    const { context, ratio } = surface;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this.#canvas, Math.round(shift.x * ratio), Math.round(shift.y * ratio));
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  /** Where the buffer's corner goes for a view; null where the buffer does not cover it. */
  #shiftTo(view: View): { x: number; y: number } | null {
    if (this.#held?.scale !== view.scale) return null;
    const x = view.x - this.#held.x;
    const y = view.y - this.#held.y;
    const isCovered = x <= 0 && y <= 0 && x >= -2 * MARGIN_PX && y >= -2 * MARGIN_PX;
    return isCovered ? { x, y } : null;
  }

  #hold(
    { size, ratio }: Surface,
    view: View,
    paint: (surface: Surface, view: View) => void,
  ): { x: number; y: number } {
    const width = size.width + 2 * MARGIN_PX;
    const height = size.height + 2 * MARGIN_PX;
    const wanted = newCanvas(width * ratio, height * ratio);
    if (this.#canvas?.width !== wanted.width || this.#canvas.height !== wanted.height) {
      this.#canvas = wanted;
    }
    const held = { ...view, x: view.x + MARGIN_PX, y: view.y + MARGIN_PX };
    const surface = { context: contextOf(this.#canvas), size: { width, height }, ratio };
    clear(surface);
    paint(surface, held);
    this.#held = held;
    return { x: -MARGIN_PX, y: -MARGIN_PX };
  }
}
