import type { CanvasPoint, MapPoint, Size } from '../geometry/coordinates';
import { createStore } from '../store/create';

/** Actions on the map for the rest of the page. */
export interface MapActions {
  readonly fit: () => void;
  readonly zoomBy: (factor: number) => void;
  /** By a share of the view's size; x to the right, y down. */
  readonly panBy: (x: number, y: number) => void;
  readonly show: (tagId: string) => void;
}

/** Null: the page shows no map. */
export const theMap = createStore<MapActions | null>(null);

const ARROWS: Readonly<Record<string, readonly [x: number, y: number]>> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};
const ZOOMS: Readonly<Record<string, number>> = { '+': 1.25, '=': 1.25, '-': 0.8 };

/** The action of a key on the map; null: none. */
export function keyAction({ key, shiftKey }: KeyboardEvent): ((map: MapActions) => void) | null {
  const [arrow, factor] = [ARROWS[key], ZOOMS[key]];
  if (arrow) {
    const far = shiftKey ? 0.5 : 0.1;
    return (map) => map.panBy(far * arrow[0], far * arrow[1]);
  }
  if (factor !== undefined) {
    return (map) => map.zoomBy(factor);
  }
  if (key !== '0' && key !== 'Home') return null;
  return (map) => map.fit();
}

/**
 * The operator's position on the map: the mouse, or the keyboard's crosshair. Not in the page's state,
 * as it moves sixty times a second and only the read-out uses it.
 */
export const pointedAt = createStore<MapPoint | null>(null);

export interface PinUnderMouse {
  readonly tagId: string;
  readonly at: CanvasPoint;
  /** Half the pin's size, pixels. */
  readonly reach: number;
  readonly within: Size;
}

export const pinUnderMouse = createStore<PinUnderMouse | null>(null);
