/** The map's camera, moved by the program and by `gestures.ts`. */
import type { Field } from '../contract/types';
import { fieldCorners } from '../domain/field';
import { memoOne } from '../domain/memo';
import { holds, isPossible, reachOfTags, type Tag } from '../domain/twin';
import { fitClear, isClear } from '../geometry/clear';
import {
  type Bounds,
  boundsOf,
  type Box,
  type Camera,
  cameraOf,
  canvasPoint,
  type CanvasPoint,
  corners,
  inSight,
  type MapPoint,
  MAX_SCALE,
  MIN_SCALE,
  type Size,
  toCanvas,
  type View,
  viewOf,
} from '../geometry/coordinates';
import { act, moveViewport, store } from '../store/app';
import { PAGE } from '../store/create';
import type { House } from '../store/twin';
import { watchGestures } from './gestures';

/** A view converted to a camera and back differs in its last digits, and must not move the map. */
const isSame = (a: View, b: View): boolean =>
  Math.abs(a.x - b.x) < 1e-3 &&
  Math.abs(a.y - b.y) < 1e-3 &&
  Math.abs(a.scale / b.scale - 1) < 1e-9;

/** Insets of a fit: less on a phone, in both orientations, as each pixel counts. */
function fitInsets({ width, height }: Size): Box {
  return width < 560 || height < 280
    ? { top: 26, right: 26, bottom: 40, left: 26 }
    : { top: 30, right: 40, bottom: 52, left: 40 };
}

const viewport = () => store.get().viewport;

/** Fits the view, follows links, and executes moves; the store has the result. */
export class MapCamera {
  /** The view at the start of the current gestures. */
  #held: View | null = null;
  /** What moves must keep in sight; null: not known yet. */
  #content: Content | null = null;
  #leastScale = MIN_SCALE;

  /** `isFixed`: only the program moves it, not wheel, finger or mouse. */
  constructor(element: HTMLElement, isFixed = false, signal = PAGE) {
    if (isFixed) return;
    const onStart = (): void => {
      // Unchanged if a drag begins before the wheel's gesture has ended.
      this.#held ??= viewport().view;
    };
    const onMove = (from: CanvasPoint, to: CanvasPoint, factor: number): void => {
      this.#show(this.#moved(from, to, factor));
    };
    const onEnd = (): void => {
      // A click is a gesture too, but moves nothing.
      const hasMoved = this.#held !== viewport().view;
      this.#held = null;
      if (hasMoved) this.#choose();
    };
    watchGestures(element, { onStart, onMove, onEnd }, signal);
  }

  /**
   * Shows a camera, or all content with no pin below a `covered` box; not a choice of the operator.
   * While the operator moves the map, it has no effect.
   */
  goTo(camera: Camera | null, content: Content | null, covered: readonly Box[] = []): void {
    if (this.#held !== null) return;
    const { size } = viewport();
    if (size.width === 0 || size.height === 0) return;
    const whole = content && fitClear(content.bounds, content.pins, size, fitInsets(size), covered);
    if (whole) {
      this.#content = content;
      this.#leastScale = whole.scale / 2;
    }
    const view = camera ? this.#inSight(viewOf(camera, size, this.#leastScale)) : whole;
    if (view) this.#show(view);
  }

  #inSight(view: View): View {
    const { size } = viewport();
    return this.#content ? inSight(view, size, this.#content.bounds) : view;
  }

  /** The view in which what is at `from` is at `to`, and `factor` times as large. */
  #moved(from: CanvasPoint, to: CanvasPoint, factor = 1): View {
    const { view } = viewport();
    const scale = Math.min(MAX_SCALE, Math.max(this.#leastScale, view.scale * factor));
    const by = scale / view.scale;
    const [x, y] = [to.x + (view.x - from.x) * by, to.y + (view.y - from.y) * by];
    return this.#inSight({ scale, x, y });
  }

  #show(view: View): void {
    if (!isSame(view, viewport().view)) moveViewport({ view });
  }

  #choose(): void {
    const { view, size } = viewport();
    act({ camera: cameraOf(view, size) });
  }

  #step(view: View): void {
    this.#show(view);
    if (this.#held === null) this.#choose();
  }

  /** Whether the operator is moving the map, or the wheel has not come to rest yet. */
  get isHeld(): boolean {
    return this.#held !== null;
  }

  zoomBy(factor: number): void {
    const { width, height } = viewport().size;
    const middle = canvasPoint(width / 2, height / 2);
    this.#step(this.#moved(middle, middle, factor));
  }

  panBy(x: number, y: number): void {
    const { width, height } = viewport().size;
    this.#step(this.#moved(canvasPoint(x * width, y * height), canvasPoint(0, 0)));
  }

  /** Brings a point into view; if it is well inside the free part, the view stays. */
  show(point: MapPoint, covered: readonly Box[] = []): void {
    const { view, size } = viewport();
    const at = toCanvas(view, point);
    const { x, y } = at;
    const { width, height } = size;
    // Where everything is shown, a pin at the edge is as far inside as can be.
    const margin = store.get().view.camera === null ? 0 : Math.min(40, height / 4);
    const isInside = x > margin && y > margin && x < width - margin && y < height - margin;
    if (width === 0 || (isInside && isClear(view, point, covered))) return;
    this.#step(this.#moved(at, canvasPoint(width / 2, height / 2)));
  }
}

export interface Content {
  readonly bounds: Bounds;
  readonly pins: readonly MapPoint[];
}

const NO_TAGS: readonly Tag[] = [];

/** Without planters that are far off: a lost robot's observations must not widen the map. */
const places = memoOne((tags: readonly Tag[]) => {
  const reach = reachOfTags(tags);
  const pins = tags.flatMap((tag) => (tag.at ? [tag.at] : []));
  const planters = tags.flatMap((tag) => tag.footprint);
  const bounds = boundsOf([...pins, ...planters.filter((corner) => holds(reach, corner))]);
  return { pins, corners: bounds ? corners(bounds) : [] };
});

/**
 * The content of a fit: pins, planters and the known part of the floor plan. Without a plan, the heat
 * map: its grid is the same for every sensor, so that a switch moves nothing. While the next one is
 * being fetched, the last one is used.
 */
export function contentOf({ snapshot, map }: House, field: Field | null): Content | null {
  const { pins, corners: planted } = places(snapshot?.tags ?? NO_TAGS);
  const known = (map.value?.known ?? []).filter(isPossible);
  // A field without tags belongs to a previous twin.
  const hasField = field && planted.length > 0 && known.length === 0;
  const bounds = boundsOf([...planted, ...(hasField ? fieldCorners(field) : []), ...known]);
  return bounds && { bounds, pins };
}

export function together(a: Content | null, b: Content | null): Content | null {
  if (!a || !b) return a ?? b;
  const bounds = boundsOf([...corners(a.bounds), ...corners(b.bounds)]);
  return bounds && { bounds, pins: [...a.pins, ...b.pins] };
}

/** Elements over the map that hide pins: buttons, scale bar, notices. */
const OVER_MAP = '[data-over-map]';

export function coveredBoxes(element: HTMLElement): Box[] {
  const map = element.getBoundingClientRect();
  return [...(element.parentElement?.querySelectorAll(OVER_MAP) ?? [])].flatMap((each) => {
    const { left, top, right, bottom, width, height } = each.getBoundingClientRect();
    if (width === 0 || height === 0) return [];
    const [x, y] = [map.left, map.top];
    return [{ left: left - x, top: top - y, right: right - x, bottom: bottom - y }];
  });
}

/** Calls back when an element over the map may have changed its size. */
export function watchCovered(
  element: HTMLElement,
  onChange: () => void,
  signal: AbortSignal,
): void {
  const observer = new ResizeObserver(onChange);
  for (const each of element.parentElement?.querySelectorAll('.map-controls, .map-foot') ?? []) {
    observer.observe(each);
  }
  signal.addEventListener('abort', () => observer.disconnect());
}
