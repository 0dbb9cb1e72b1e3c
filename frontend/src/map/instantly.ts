/**
 * In the place of d3-transition and d3-interpolate, which d3-zoom asks for: no gesture of this map
 * is animated, so there is nothing to interrupt or to go through, and ten kilobytes of colours and
 * curves are not loaded.
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
