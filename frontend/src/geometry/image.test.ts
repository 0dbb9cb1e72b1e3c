import { describe, expect, test } from 'vitest';

import { mapPoint, toCanvas } from './coordinates';
import { imageToCanvas, mapPlacement, opaqueBox, pixelBoxCorners, yawOf } from './image';

const view = { x: 200, y: 500, scale: 40 };
const upright = { originX: -1, originY: 2, yaw: 0, resolution: 0.5, width: 4, height: 6 };

const apply = (
  [a, b, c, d, e, f]: readonly number[],
  x: number,
  y: number,
): { x: number; y: number } => ({
  x: (a ?? 0) * x + (c ?? 0) * y + (e ?? 0),
  y: (b ?? 0) * x + (d ?? 0) * y + (f ?? 0),
});

describe('a picture in the map', () => {
  test('its lower left corner is the origin: the top row is the last row of the grid', () => {
    const affine = imageToCanvas(upright, view);
    const origin = toCanvas(view, mapPoint(-1, 2));
    expect(apply(affine, 0, 6).x).toBeCloseTo(origin.x);
    expect(apply(affine, 0, 6).y).toBeCloseTo(origin.y);
    const topRight = toCanvas(view, mapPoint(-1 + 4 * 0.5, 2 + 6 * 0.5));
    expect(apply(affine, 4, 0).x).toBeCloseTo(topRight.x);
    expect(apply(affine, 4, 0).y).toBeCloseTo(topRight.y);
  });

  test('a yaw turns it counter-clockwise about the origin', () => {
    const turned = { ...upright, yaw: Math.PI / 2 };
    const affine = imageToCanvas(turned, view);
    // One column to the right of the origin in the grid is one cell up in the map.
    const along = toCanvas(view, mapPoint(-1, 2.5));
    expect(apply(affine, 1, 6).x).toBeCloseTo(along.x);
    expect(apply(affine, 1, 6).y).toBeCloseTo(along.y);
    // One row up in the grid is one cell to the left.
    const up = toCanvas(view, mapPoint(-1.5, 2));
    expect(apply(affine, 0, 5).x).toBeCloseTo(up.x);
    expect(apply(affine, 0, 5).y).toBeCloseTo(up.y);
  });

  test('its corners in the map agree with the drawing', () => {
    const turned = { ...upright, yaw: 0.4 };
    const affine = imageToCanvas(turned, view);
    const box = { left: 1, top: 2, right: 3, bottom: 5 };
    const [lowerLeft] = pixelBoxCorners(turned, box);
    const drawn = apply(affine, 1, 5);
    const expected = toCanvas(view, lowerLeft ?? mapPoint(0, 0));
    expect(drawn.x).toBeCloseTo(expected.x);
    expect(drawn.y).toBeCloseTo(expected.y);
  });
});

test('yaw of a quaternion about z', () => {
  const half = 0.35;
  expect(yawOf({ x: 0, y: 0, z: Math.sin(half), w: Math.cos(half) })).toBeCloseTo(0.7);
  expect(yawOf({ x: 0, y: 0, z: 0, w: 0 })).toBe(0);
  expect(yawOf({ x: null, y: null, z: null, w: null })).toBe(0);
});

test('placement of an occupancy grid', () => {
  const placement = mapPlacement({
    header: { stamp: 0, frame_id: 'map' },
    info: {
      map_load_time: 0,
      resolution: 0.05,
      width: 80,
      height: 160,
      origin: {
        position: { x: -0.5, y: 0.25, z: 0 },
        orientation: { x: 0, y: 0, z: 1, w: 0 },
      },
    },
  });
  expect(placement).toMatchObject({ originX: -0.5, originY: 0.25, resolution: 0.05 });
  expect(Math.abs(placement.yaw)).toBeCloseTo(Math.PI);
});

test('the known part of a picture', () => {
  const rgba = new Uint8ClampedArray(5 * 4 * 4);
  rgba[(1 * 5 + 2) * 4 + 3] = 255;
  rgba[(2 * 5 + 3) * 4 + 3] = 1;
  expect(opaqueBox(rgba, 5, 4)).toEqual({ left: 2, top: 1, right: 4, bottom: 3 });
  expect(opaqueBox(new Uint8ClampedArray(16), 2, 2)).toBeNull();
});
