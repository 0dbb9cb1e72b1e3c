import type { CanvasPoint, MapPoint, Size } from '../geometry/coordinates';
import { createStore } from '../store/create';

/**
 * Where the operator points at in the map: the mouse, or the crosshair of the keyboard. Apart
 * from the page's state, because it moves sixty times a second and only the read-out follows.
 */
export const pointedAt = createStore<MapPoint | null, MapPoint | null>(null, (_, next) => next);

export interface PinUnderMouse {
  readonly tagId: string;
  readonly at: CanvasPoint;
  /** Half the pin's size, pixels. */
  readonly reach: number;
  /** Of the map view. */
  readonly within: Size;
}

/** The pin that the mouse rests on; the same object as long as it is the same pin and place. */
export const pinUnderMouse = createStore<PinUnderMouse | null, PinUnderMouse | null>(
  null,
  (before, next) =>
    before?.tagId === next?.tagId && before?.at.x === next?.at.x && before?.at.y === next?.at.y
      ? before
      : next,
);
