import { select } from 'd3-selection';
import { zoom, zoomIdentity, type D3ZoomEvent, type ZoomTransform } from 'd3-zoom';

import {
  cameraOf,
  fit,
  MAX_SCALE,
  MIN_SCALE,
  toCanvas,
  viewOf,
  type Bounds,
  type Camera,
  type Insets,
  type MapPoint,
  type Size,
  type View,
} from '../geometry/coordinates';

export interface CameraHandlers {
  readonly onView: (view: View) => void;
  /** The operator came to rest on a view. */
  readonly onCamera: (camera: Camera) => void;
}

const toView = ({ x, y, k }: ZoomTransform): View => ({ x, y, scale: k });

/** A view that was told as a camera and comes back differs in its last digits, and moves nothing. */
const isSame = (a: View, b: View): boolean =>
  Math.abs(a.x - b.x) < 1e-3 &&
  Math.abs(a.y - b.y) < 1e-3 &&
  Math.abs(a.scale / b.scale - 1) < 1e-9;

/** Space around what is fitted: less on a phone, where each pixel counts. */
export function fitInsets({ width }: Size): Insets {
  return width < 560
    ? { top: 26, right: 60, bottom: 40, left: 26 }
    : { top: 30, right: 76, bottom: 52, left: 40 };
}

/** Wheel, pinch and drag on one element, and the programmed moves; d3-zoom keeps the transform. */
export class MapCamera {
  readonly #selection;
  readonly #zoom;
  #size: Size = { width: 0, height: 0 };
  #view: View = { x: 0, y: 0, scale: 50 };
  /** A move of the program's own is no choice of the operator's. */
  #programmed = false;
  /** The view that the gestures under way began with. */
  #held: View | null = null;

  /** `isFixed`: the program alone moves it; no wheel, finger or mouse does. */
  constructor(element: HTMLElement, handlers: CameraHandlers, isFixed = false) {
    this.#selection = select<HTMLElement, unknown>(element);
    this.#zoom = zoom<HTMLElement, unknown>()
      .scaleExtent([MIN_SCALE, MAX_SCALE])
      // Without the browser's layout: the size is known from the resize observer.
      .extent(() => [
        [0, 0],
        [this.#size.width, this.#size.height],
      ])
      .clickDistance(6)
      .on('zoom', (event: D3ZoomEvent<HTMLElement, unknown>) => {
        this.#view = toView(event.transform);
        handlers.onView(this.#view);
      })
      .on('start', () => {
        // Not anew by a hand that grabs the map before the gesture of the wheel has ended.
        if (!this.#programmed) this.#held ??= this.#view;
      })
      .on('end', () => {
        if (this.#programmed) return;
        // A click is a gesture too, and moves nothing.
        const hasMoved = this.#held !== this.#view;
        this.#held = null;
        if (hasMoved) handlers.onCamera(cameraOf(this.#view, this.#size));
      });
    if (isFixed) this.#zoom.filter(() => false);
    this.#selection.call(this.#zoom);
  }

  get view(): View {
    return this.#view;
  }

  get size(): Size {
    return this.#size;
  }

  resize(size: Size): void {
    this.#size = size;
  }

  /**
   * Shows a camera, or everything within `bounds`. Not told to `onCamera`. While the operator has
   * hold of the map it stays with the operator, whatever else arrives.
   */
  goTo(camera: Camera | null, bounds: Bounds | null): void {
    if (this.#held !== null) return;
    if (this.#size.width === 0 || this.#size.height === 0) return;
    const view = camera
      ? viewOf(camera, this.#size)
      : bounds && fit(bounds, this.#size, fitInsets(this.#size));
    if (!view) return;
    if (isSame(view, this.#view)) return;
    this.#programmed = true;
    this.#zoom.transform(this.#selection, zoomIdentity.translate(view.x, view.y).scale(view.scale));
    this.#programmed = false;
  }

  zoomBy(factor: number): void {
    this.#zoom.scaleBy(this.#selection, factor);
  }

  /** Moves what is seen, by a share of the view's size. */
  panBy(x: number, y: number): void {
    const { scale } = this.#view;
    this.#zoom.translateBy(
      this.#selection,
      (-x * this.#size.width) / scale,
      (-y * this.#size.height) / scale,
    );
  }

  /** Brings a point into view; one that is well inside the free part stays where it is. */
  show(point: MapPoint, coveredBelow: number): void {
    const { x, y } = toCanvas(this.#view, point);
    const { width } = this.#size;
    const height = Math.max(0, this.#size.height - coveredBelow);
    const margin = Math.min(40, height / 4);
    const isInside = x > margin && y > margin && x < width - margin && y < height - margin;
    if (isInside || width === 0) return;
    this.#zoom.translateTo(this.#selection, point.x, -point.y, [width / 2, height / 2]);
  }

  destroy(): void {
    this.#selection.on('.zoom', null);
  }
}
