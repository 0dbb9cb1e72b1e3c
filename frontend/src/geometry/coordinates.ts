/**
 * Two frames and the one pair of conversions between them.
 *
 * `MapPoint`: metres in the map frame, x right, y up. `CanvasPoint`: CSS pixels in the map view,
 * x right, y down. The branding makes a mix-up a compile error; y is flipped only here.
 */
export type MapPoint = Readonly<{ x: number; y: number }> & { readonly __frame: 'map' };
export type CanvasPoint = Readonly<{ x: number; y: number }> & { readonly __frame: 'canvas' };

export const mapPoint = (x: number, y: number): MapPoint => ({ x, y }) as MapPoint;
export const canvasPoint = (x: number, y: number): CanvasPoint => ({ x, y }) as CanvasPoint;

/**
 * Place of the map on the canvas: the map's origin is at (x, y) pixels, one metre is `scale`
 * pixels.
 */
export interface View {
  readonly x: number;
  readonly y: number;
  readonly scale: number;
}

export interface Size {
  readonly width: number;
  readonly height: number;
}

/** Metres in the map frame. */
export interface Bounds {
  readonly minX: number;
  readonly minY: number;
  readonly maxX: number;
  readonly maxY: number;
}

/** The four sides of an upright box in pixels, or the insets at each. */
export type Box = Readonly<Record<'left' | 'top' | 'right' | 'bottom', number>>;

export function toCanvas(view: View, point: MapPoint): CanvasPoint {
  return canvasPoint(view.x + point.x * view.scale, view.y - point.y * view.scale);
}

export function toMap(view: View, point: CanvasPoint): MapPoint {
  return mapPoint((point.x - view.x) / view.scale, (view.y - point.y) / view.scale);
}

/** The item closest to a canvas point within `reach` pixels; the last of equals; null: none. */
export function nearest<T extends { readonly at: MapPoint }>(
  items: readonly T[],
  view: View,
  point: CanvasPoint,
  reach: number,
): T | null {
  let best: T | null = null;
  let bestDistance = reach;
  for (const item of items) {
    const { x, y } = toCanvas(view, item.at);
    const distance = Math.hypot(x - point.x, y - point.y);
    if (distance > bestDistance) continue;
    best = item;
    bestDistance = distance;
  }
  return best;
}

export function boundsOf(points: Iterable<MapPoint>): Bounds | null {
  let minX = Infinity;
  let minY = Infinity;
  let maxX = -Infinity;
  let maxY = -Infinity;
  for (const { x, y } of points) {
    minX = Math.min(minX, x);
    minY = Math.min(minY, y);
    maxX = Math.max(maxX, x);
    maxY = Math.max(maxY, y);
  }
  return minX <= maxX ? { minX, minY, maxX, maxY } : null;
}

/** Widened by this much on each side. */
export const widened = ({ minX, minY, maxX, maxY }: Bounds, by: number): Bounds => ({
  ...{ minX: minX - by, minY: minY - by, maxX: maxX + by, maxY: maxY + by },
});

export function corners(bounds: Bounds): MapPoint[] {
  return [
    mapPoint(bounds.minX, bounds.minY),
    mapPoint(bounds.maxX, bounds.minY),
    mapPoint(bounds.maxX, bounds.maxY),
    mapPoint(bounds.minX, bounds.maxY),
  ];
}

/** Least scale until the content is known; then half of its fit. */
export const MIN_SCALE = 4;
export const MAX_SCALE = 2000;
/** A single tag has a box of no size; a fit shows at least this much around it, in metres. */
const MIN_EXTENT_M = 2;

/** The view that shows all of `bounds`, centred in what the insets leave free. */
export function fit(bounds: Bounds, size: Size, insets: Box): View {
  const width = Math.max(1, size.width - insets.left - insets.right);
  const height = Math.max(1, size.height - insets.top - insets.bottom);
  const extentX = Math.max(MIN_EXTENT_M, bounds.maxX - bounds.minX);
  const extentY = Math.max(MIN_EXTENT_M, bounds.maxY - bounds.minY);
  const scale = Math.min(MAX_SCALE, width / extentX, height / extentY);
  const centre = mapPoint((bounds.minX + bounds.maxX) / 2, (bounds.minY + bounds.maxY) / 2);
  return {
    scale,
    x: insets.left + width / 2 - centre.x * scale,
    y: insets.top + height / 2 + centre.y * scale,
  };
}

/** A view independent of the screen: its centre, and the metres across the shorter side. */
export interface Camera {
  readonly x: number;
  readonly y: number;
  readonly span: number;
}

export function cameraOf(view: View, size: Size): Camera {
  const centre = toMap(view, canvasPoint(size.width / 2, size.height / 2));
  return { x: centre.x, y: centre.y, span: Math.min(size.width, size.height) / view.scale };
}

export function viewOf(camera: Camera, size: Size, leastScale = MIN_SCALE): View {
  const wanted = Math.min(size.width, size.height) / camera.span;
  const scale = Math.min(MAX_SCALE, Math.max(leastScale, wanted));
  return {
    scale,
    x: size.width / 2 - camera.x * scale,
    y: size.height / 2 + camera.y * scale,
  };
}

/** How much of the bounds stays visible, pixels along each side. */
const VISIBLE_PX = 40;

/** The view, moved back so that part of the bounds is visible. */
export function inSight({ x, y, scale }: View, size: Size, bounds: Bounds): View {
  const clamp = (value: number, low: number, high: number): number =>
    Math.max(low, Math.min(high, value));
  return {
    scale,
    x: clamp(x, VISIBLE_PX - bounds.maxX * scale, size.width - VISIBLE_PX - bounds.minX * scale),
    y: clamp(y, VISIBLE_PX + bounds.minY * scale, size.height - VISIBLE_PX + bounds.maxY * scale),
  };
}

/** The largest 1, 2 or 5 times a power of ten that is not above `value`. */
export function niceFloor(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value));
  const digit = value / power;
  return (digit >= 5 ? 5 : digit >= 2 ? 2 : 1) * power;
}

/** The longest round length that fits into `maxPixels`. */
export function scaleBar(scale: number, maxPixels: number) {
  const metres = niceFloor(maxPixels / scale);
  return { metres, pixels: metres * scale };
}

/** A round length as text: 20 cm, 5 m, 1 km. */
export function lengthText(metres: number): string {
  if (metres >= 1000) return `${trim(metres / 1000)} km`;
  if (metres >= 1) return `${trim(metres)} m`;
  return `${trim(metres * 100)} cm`;
}

const trim = (value: number): string => String(Number(value.toPrecision(3)));

/** Metres between two lines of the grid, so that they stay at least `minPixels` apart. */
export function gridStep(scale: number, minPixels: number): number {
  const least = minPixels / scale;
  const step = niceFloor(least);
  if (step >= least) return step;
  const digit = Math.round(step / 10 ** Math.floor(Math.log10(step)));
  return step * (digit === 2 ? 2.5 : 2);
}
