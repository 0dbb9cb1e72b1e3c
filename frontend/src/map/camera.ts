import { select } from 'd3-selection';
import { zoom, zoomIdentity, type D3ZoomEvent, type ZoomTransform } from 'd3-zoom';

import { fitClear, isClear, type Box } from '../geometry/clear';
import {
  cameraOf,
  inSight,
  MAX_SCALE,
  MIN_SCALE,
  toCanvas,
  viewOf,
  type Camera,
  type Insets,
  type MapPoint,
  type Size,
  type View,
} from '../geometry/coordinates';
import type { Viewport } from '../store/viewport';
import type { Content } from './content';

export interface CameraHandlers {
  /** What is on the screen now; the store has it, and nobody but this camera moves it. */
  readonly viewport: () => Viewport;
  readonly onView: (view: View) => void;
  /** The operator came to rest on a view. */
  readonly onCamera: (camera: Camera) => void;
}

const transformOf = ({ x, y, scale }: View): ZoomTransform =>
  zoomIdentity.translate(x, y).scale(scale);

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

/**
 * Wheel, pinch and drag on one element, and the programmed moves. Where they lead is told and
 * kept in the store; d3-zoom has its own copy, on the element.
 */
export class MapCamera {
  readonly #selection;
  readonly #zoom;
  readonly #viewport: () => Viewport;
  /** A move of the program's own is no choice of the operator's. */
  #programmed = false;
  /** The view that the gestures under way began with. */
  #held: View | null = null;
  /** What no move leads away from; null: not known yet. */
  #content: Content | null = null;
  #leastScale = MIN_SCALE;

  /** `isFixed`: the program alone moves it; no wheel, finger or mouse does. */
  constructor(element: HTMLElement, handlers: CameraHandlers, isFixed = false) {
    this.#viewport = handlers.viewport;
    this.#selection = select<HTMLElement, unknown>(element);
    this.#zoom = zoom<HTMLElement, unknown>()
      .scaleExtent([MIN_SCALE, MAX_SCALE])
      // Without the browser's layout: the size is known from the resize observer.
      .extent(() => [
        [0, 0],
        [this.#viewport().size.width, this.#viewport().size.height],
      ])
      .constrain((transform) => transformOf(this.#inSight(toView(transform))))
      .clickDistance(6)
      // At once, by the double click too: nothing here is animated (see `instantly.ts`).
      .duration(0);
    if (isFixed) this.#zoom.filter(() => false);
    this.#selection.call(this.#zoom);
    // A map that comes back into the page goes on where it was.
    this.#zoom.transform(this.#selection, transformOf(this.#viewport().view));
    this.#zoom
      .on('zoom', (event: D3ZoomEvent<HTMLElement, unknown>) => {
        handlers.onView(toView(event.transform));
      })
      .on('start', () => {
        // Not anew by a hand that grabs the map before the gesture of the wheel has ended.
        if (!this.#programmed) this.#held ??= this.#viewport().view;
      })
      .on('end', () => {
        if (this.#programmed) return;
        // A click is a gesture too, and moves nothing.
        const { view, size } = this.#viewport();
        const hasMoved = this.#held !== view;
        this.#held = null;
        if (hasMoved) handlers.onCamera(cameraOf(view, size));
      });
  }

  /**
   * Shows a camera, or everything there is, with no pin below what is `covered`. Not told to
   * `onCamera`. While the operator has hold of the map it stays with the operator, whatever else
   * arrives.
   */
  goTo(camera: Camera | null, content: Content | null, covered: readonly Box[] = []): void {
    if (this.#held !== null) return;
    const { view: before, size } = this.#viewport();
    if (size.width === 0 || size.height === 0) return;
    const whole = content && fitClear(content.bounds, content.pins, size, fitInsets(size), covered);
    if (whole) {
      this.#content = content;
      this.#leastScale = Math.min(MIN_SCALE, whole.scale);
      this.#zoom.scaleExtent([this.#leastScale, MAX_SCALE]);
    }
    const view = camera ? this.#inSight(viewOf(camera, size, this.#leastScale)) : whole;
    if (!view) return;
    if (isSame(view, before)) return;
    this.#programmed = true;
    this.#zoom.transform(this.#selection, transformOf(view));
    this.#programmed = false;
  }

  #inSight(view: View): View {
    const { size } = this.#viewport();
    return this.#content ? inSight(view, size, this.#content.bounds) : view;
  }

  /** Whether the operator has hold of the map, or the wheel has not yet come to rest. */
  get isHeld(): boolean {
    return this.#held !== null;
  }

  zoomBy(factor: number): void {
    this.#zoom.scaleBy(this.#selection, factor);
  }

  /** Moves what is seen, by a share of the view's size. */
  panBy(x: number, y: number): void {
    const { view, size } = this.#viewport();
    this.#zoom.translateBy(
      this.#selection,
      (-x * size.width) / view.scale,
      (-y * size.height) / view.scale,
    );
  }

  /** Brings a point into view; one that is well inside the free part stays where it is. */
  show(point: MapPoint, coveredBelow: number, covered: readonly Box[] = []): void {
    const { view, size } = this.#viewport();
    const { x, y } = toCanvas(view, point);
    const { width } = size;
    const height = Math.max(0, size.height - coveredBelow);
    const margin = Math.min(40, height / 4);
    const isInside = x > margin && y > margin && x < width - margin && y < height - margin;
    if (width === 0 || (isInside && isClear(view, point, covered))) return;
    this.#zoom.translateTo(this.#selection, point.x, -point.y, [width / 2, height / 2]);
  }

  destroy(): void {
    this.#selection.on('.zoom', null);
  }
}
