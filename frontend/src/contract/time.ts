/** Times of the wire. */
import type { components } from './openapi.gen';

type WireTime = components['schemas']['Time'];

/** Never negative: a clock may have gone back. */
export const secondsBetween = (from: WireTime, to: WireTime): number =>
  Math.max(0, to.sec - from.sec + (to.nanosec - from.nanosec) / 1e9);
