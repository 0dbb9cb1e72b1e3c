/**
 * Replaces d3-transition and d3-interpolate, which d3-zoom imports: no gesture of this map is
 * animated, so nothing needs interrupting or interpolating, and ten kilobytes are saved.
 */
import { selection } from 'd3-selection';

export const interrupt = (): void => undefined;

Object.assign(selection.prototype, {
  interrupt<T>(this: T): T {
    return this;
  },
});

export const interpolateZoom = (): never => {
  throw new Error('the map is not animated');
};
