import { fetchMap, fetchMapPicture } from '../contract/api';
import type { OccupancyGrid } from '../contract/types';
import { mapPlacement, opaqueBox, pixelBoxCorners, type MapPicture } from '../geometry/image';

/**
 * Fetches the map's place and its picture. The map may grow between the two requests; a picture
 * of another size than announced is an error, and the caller tries again.
 */
export async function loadMap(signal: AbortSignal): Promise<MapPicture> {
  const [grid, blob] = await Promise.all([fetchMap(signal), fetchMapPicture(signal)]);
  const bitmap = await createImageBitmap(blob);
  try {
    return decode(grid, bitmap);
  } finally {
    bitmap.close();
  }
}

function decode(grid: OccupancyGrid, bitmap: ImageBitmap): MapPicture {
  const { width, height } = bitmap;
  const placement = mapPlacement(grid);
  if (width !== placement.width || height !== placement.height) {
    throw new Error(
      `map: the picture is ${width} x ${height}, announced were ` +
        `${placement.width} x ${placement.height}`,
    );
  }
  const canvas = document.createElement('canvas');
  canvas.width = width;
  canvas.height = height;
  const context = canvas.getContext('2d', { willReadFrequently: true });
  if (!context) throw new Error('map: this browser has no 2d canvas');
  context.drawImage(bitmap, 0, 0);
  const pixels = context.getImageData(0, 0, width, height);
  const box = opaqueBox(pixels.data, width, height);
  return { placement, pixels, known: box ? pixelBoxCorners(placement, box) : [] };
}
