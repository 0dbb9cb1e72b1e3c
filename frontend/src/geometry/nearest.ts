import { toCanvas, type CanvasPoint, type MapPoint, type View } from './coordinates';

/** The item closest to a canvas point within `reach` pixels; null where there is none. */
export function nearest<T extends { readonly at: MapPoint }>(
  items: Iterable<T>,
  view: View,
  point: CanvasPoint,
  reach: number,
): T | null {
  let best: T | null = null;
  let bestDistance = reach;
  for (const item of items) {
    const { x, y } = toCanvas(view, item.at);
    const distance = Math.hypot(x - point.x, y - point.y);
    if (distance <= bestDistance) {
      best = item;
      bestDistance = distance;
    }
  }
  return best;
}
