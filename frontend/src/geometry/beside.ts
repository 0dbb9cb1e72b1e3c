import { canvasPoint, type CanvasPoint, type Size } from './coordinates';

/** Between a pin and what stands beside it, and to the edge of the map, pixels. */
const GAP_PX = 10;
const EDGE_PX = 6;

const clamp = (value: number, most: number): number =>
  Math.max(EDGE_PX, Math.min(value, most - EDGE_PX));

/**
 * Upper left corner of a box beside a pin of half size `reach`: to its right if there is room,
 * else to its left, below or above; always within the view, as far as the view is large enough.
 */
export function beside(pin: CanvasPoint, reach: number, box: Size, within: Size): CanvasPoint {
  const away = reach + GAP_PX;
  const x = clamp(pin.x - box.width / 2, within.width - box.width);
  const y = clamp(pin.y - box.height / 2, within.height - box.height);
  const right = pin.x + away;
  const left = pin.x - away - box.width;
  const below = pin.y + away;
  const above = pin.y - away - box.height;
  if (right + box.width <= within.width - EDGE_PX) return canvasPoint(right, y);
  if (left >= EDGE_PX) return canvasPoint(left, y);
  if (below + box.height <= within.height - EDGE_PX) return canvasPoint(x, below);
  return canvasPoint(x, Math.max(EDGE_PX, above));
}
