import type { CanvasPoint, MapPoint, Size } from '../geometry/coordinates';
import { createStore } from '../store/create';

export type MapCommand =
  | { readonly type: 'fit' }
  | { readonly type: 'zoom'; readonly factor: number }
  /** Share of the view's size to move by; x to the right, y down. */
  | { readonly type: 'pan'; readonly x: number; readonly y: number }
  | { readonly type: 'show'; readonly tagId: string }
  /** Shows the layers as on paper, without what moves or follows the pointer, while `take` runs. */
  | { readonly type: 'picture'; readonly take: () => void };

const listeners = new Set<(command: MapCommand) => void>();

export function onMapCommand(listener: (command: MapCommand) => void): () => void {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

export function commandMap(command: MapCommand): void {
  for (const listener of [...listeners]) listener(command);
}

export function keyCommand({ key, shiftKey }: KeyboardEvent): MapCommand | null {
  const far = shiftKey ? 0.5 : 0.1;
  switch (key) {
    case 'ArrowLeft':
      return { type: 'pan', x: -far, y: 0 };
    case 'ArrowRight':
      return { type: 'pan', x: far, y: 0 };
    case 'ArrowUp':
      return { type: 'pan', x: 0, y: -far };
    case 'ArrowDown':
      return { type: 'pan', x: 0, y: far };
    case '+':
    case '=':
      return { type: 'zoom', factor: 1.25 };
    case '-':
      return { type: 'zoom', factor: 0.8 };
    case '0':
    case 'Home':
      return { type: 'fit' };
    default:
      return null;
  }
}

/**
 * Where the operator points at in the map: the mouse, or the crosshair of the keyboard. Apart
 * from the page's state, because it moves sixty times a second and only the read-out follows.
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
