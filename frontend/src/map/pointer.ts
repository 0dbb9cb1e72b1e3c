import { createStore } from '../store/create';
import type { MapPoint } from '../geometry/coordinates';

/**
 * Where the operator points at in the map: the mouse, or the crosshair of the keyboard. Apart
 * from the page's state, because it moves sixty times a second and only the read-out follows.
 */
export const pointedAt = createStore<MapPoint | null, MapPoint | null>(null, (_, next) => next);
