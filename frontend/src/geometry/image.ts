import type { OccupancyGrid } from '../contract/types';
import { type Box, mapPoint, type MapPoint, type View } from './coordinates';

/** Place of an upright or rotated picture in the map: its lower left corner, size and yaw. */
export interface Placement {
  /** Lower left corner of the grid's cell (0, 0), metres in the map frame. */
  readonly originX: number;
  readonly originY: number;
  /** Rotation about that corner, radians, counter-clockwise. */
  readonly yaw: number;
  /** Metres per pixel. */
  readonly resolution: number;
  /** Pixels. */
  readonly width: number;
  readonly height: number;
}

export interface MapPicture {
  readonly placement: Placement;
  readonly pixels: ImageData;
  /** Corners of the box around the known part of the map; empty if nothing is known. */
  readonly known: readonly MapPoint[];
}

/** Yaw of a rotation about z; a quaternion of zeros counts as no rotation. */
export function yawOf(of: Readonly<Record<'x' | 'y' | 'z' | 'w', number | null>>): number {
  const [x, y, z, w] = [of.x ?? 0, of.y ?? 0, of.z ?? 0, of.w ?? 0];
  return Math.atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z);
}

export function mapPlacement(grid: OccupancyGrid): Placement {
  const { origin, resolution, width, height } = grid.info;
  return {
    originX: origin.position.x ?? 0,
    originY: origin.position.y ?? 0,
    yaw: yawOf(origin.orientation),
    resolution,
    width,
    height,
  };
}

/**
 * Converts a picture's pixels (column, row from the top) to canvas pixels. The picture's top row is
 * the grid's last row: pixel (column, row) lies at ((column), (height - row)) * resolution in
 * the grid, which is then rotated by yaw and moved to the origin.
 */
export function imageToCanvas(placement: Placement, view: View) {
  const { originX, originY, yaw, resolution, height } = placement;
  const cos = Math.cos(yaw) * resolution;
  const sin = Math.sin(yaw) * resolution;
  const leftTopX = originX - sin * height;
  const leftTopY = originY + cos * height;
  return [
    cos * view.scale,
    -sin * view.scale,
    sin * view.scale,
    cos * view.scale,
    view.x + leftTopX * view.scale,
    view.y - leftTopY * view.scale,
  ] as const;
}

/** Corners in the map frame of the pixels from (left, top) to (right, bottom), exclusive. */
export function pixelBoxCorners(placement: Placement, box: Box): MapPoint[] {
  // On a canvas of one pixel per metre, with y down.
  const [a, b, c, d, e, f] = imageToCanvas(placement, { x: 0, y: 0, scale: 1 });
  const place = (column: number, row: number): MapPoint =>
    mapPoint(a * column + c * row + e, -(b * column + d * row + f));
  return [
    place(box.left, box.bottom),
    place(box.right, box.bottom),
    place(box.right, box.top),
    place(box.left, box.top),
  ];
}

/** The smallest pixel box that holds every pixel which is not fully transparent. */
export function opaqueBox(rgba: Uint8ClampedArray, width: number, height: number): Box | null {
  let left = width;
  let right = 0;
  let top = height;
  let bottom = 0;
  for (let row = 0; row < height; row++) {
    for (let column = 0; column < width; column++) {
      if (rgba[(row * width + column) * 4 + 3] === 0) continue;
      if (column < left) left = column;
      if (column >= right) right = column + 1;
      if (row < top) top = row;
      bottom = row + 1;
    }
  }
  return left < right ? { left, top, right, bottom } : null;
}
