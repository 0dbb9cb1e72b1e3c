/** Where a field ends: the lines between what is known and what is not. Pure. */
import type { Field } from '../contract/types';

/** Straight lines as x0, y0, x1, y1, metres in the map frame, one after the other. */
export function edgesOf({ width, height, originX, originY, resolution, values }: Field): number[] {
  const isKnown = (x: number, y: number): boolean =>
    x >= 0 && x < width && y >= 0 && y < height && !Number.isNaN(values[y * width + x]);
  const lines: number[] = [];
  const line = (x0: number, y0: number, x1: number, y1: number): void => {
    lines.push(
      ...[originX + x0 * resolution, originY + y0 * resolution],
      ...[originX + x1 * resolution, originY + y1 * resolution],
    );
  };
  // Runs of cell sides on one straight line are one line.
  const runs = (
    count: number,
    isEdge: (index: number) => boolean,
    draw: (from: number, to: number) => void,
  ): void => {
    let from = -1;
    for (let index = 0; index <= count; index++) {
      const is = index < count && isEdge(index);
      if (is && from < 0) from = index;
      if (is || from < 0) continue;
      draw(from, index);
      from = -1;
    }
  };
  for (let y = 0; y <= height; y++) {
    runs(
      width,
      (x) => isKnown(x, y - 1) !== isKnown(x, y),
      (from, to) => {
        line(from, y, to, y);
      },
    );
  }
  for (let x = 0; x <= width; x++) {
    runs(
      height,
      (y) => isKnown(x - 1, y) !== isKnown(x, y),
      (from, to) => {
        line(x, from, x, to);
      },
    );
  }
  return lines;
}
