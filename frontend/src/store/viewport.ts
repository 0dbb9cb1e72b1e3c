/** What of the map is on the screen just now; what the operator chose is the view's camera. */
import type { Size, View } from '../geometry/coordinates';

export interface Viewport {
  /** Where the map is on its canvas. */
  readonly view: View;
  /** Of the canvas, CSS pixels; 0 until it is laid out. */
  readonly size: Size;
}

export const NO_VIEWPORT: Viewport = {
  view: { x: 0, y: 0, scale: 50 },
  size: { width: 0, height: 0 },
};
