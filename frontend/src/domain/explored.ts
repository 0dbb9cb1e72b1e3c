/** What of an estimate lies on explored ground, as the twin clips the nearest readings. Pure. */
import type { Field } from '../contract/types';
import type { Placement } from '../geometry/image';

/** A map's picture: RGBA, top row first; transparent is not explored. */
interface Explored {
  readonly placement: Placement;
  readonly pixels: Pick<ImageData, 'data' | 'width' | 'height'>;
}

/** An estimate tells a number for every cell, outside the house too; there it is not asked. */
export function onExplored(field: Field, { placement, pixels }: Explored): Field {
  const { sureness, width, originX, originY, resolution } = field;
  if (!sureness) return field;
  const cos = Math.cos(placement.yaw);
  const sin = Math.sin(placement.yaw);
  const isExplored = (cell: number): boolean => {
    const x = originX + ((cell % width) + 0.5) * resolution - placement.originX;
    const y = originY + (Math.floor(cell / width) + 0.5) * resolution - placement.originY;
    const column = Math.floor((cos * x + sin * y) / placement.resolution);
    const row = Math.floor((cos * y - sin * x) / placement.resolution);
    if (column < 0 || column >= pixels.width || row < 0 || row >= pixels.height) return false;
    const pixel = (pixels.height - 1 - row) * pixels.width + column;
    return (pixels.data[pixel * 4 + 3] ?? 0) > 0;
  };
  const values = field.values.slice();
  const sd = sureness.sd.slice();
  for (let cell = 0; cell < values.length; cell++) {
    if (isExplored(cell)) continue;
    values[cell] = NaN;
    sd[cell] = NaN;
  }
  return { ...field, values, sureness: { ...sureness, sd } };
}
