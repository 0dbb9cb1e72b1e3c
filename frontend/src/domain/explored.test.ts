import { expect, test } from 'vitest';

import { estimated } from '../testing/estimate';
import { onExplored } from './explored';

/** Two by two pixels of 1 m from (1, 0) on, of which the one at the lower left is explored. */
const map = (yaw = 0): Parameters<typeof onExplored>[1] => {
  const data = new Uint8ClampedArray(16);
  data[2 * 4 + 3] = 255;
  return {
    placement: { originX: 1, originY: 0, yaw, resolution: 1, width: 2, height: 2 },
    pixels: { data, width: 2, height: 2 },
  };
};
const known = (values: Float32Array | undefined): boolean[] =>
  [...(values ?? [])].map((value) => !Number.isNaN(value));

test('an estimate ends where the map does, and where nothing is explored', () => {
  const clipped = onExplored(estimated([20, 21, 22, 23], [1, 1, 1, 1]), map());
  expect(known(clipped.values)).toEqual([false, true, false, false]);
  expect(known(clipped.sureness?.sd)).toEqual([false, true, false, false]);
  // A quarter turn about the corner: the explored pixel then lies before it.
  const turned = onExplored(estimated([20, 21, 22, 23], [1, 1, 1, 1]), map(Math.PI / 2));
  expect(known(turned.values)).toEqual([true, false, false, false]);
});

test('what the twin has clipped already stays the same', () => {
  const { sureness, ...field } = estimated([20, 21], [1, 1]);
  expect(sureness).toBeDefined();
  expect(onExplored(field, map())).toBe(field);
});
