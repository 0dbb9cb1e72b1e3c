import {
  boundsOf,
  toCanvas,
  toMap,
  type CanvasPoint,
  type MapPoint,
  type View,
} from './coordinates';

interface Entry<T> {
  readonly item: T;
  /** Its place among all: the later is drawn over the earlier. */
  readonly index: number;
}

/** Points by the squares of the map that they lie in, so that a look at a few costs a few. */
export class Grid<T extends { readonly at: MapPoint }> {
  readonly #squares = new Map<number, Entry<T>[]>();
  readonly #minX: number;
  readonly #minY: number;
  /** Side of a square, metres; about one item a square. */
  readonly #side: number;
  readonly #columns: number;
  readonly #rows: number;

  constructor(items: readonly T[]) {
    const bounds = boundsOf(items.map(({ at }) => at));
    const { minX, minY, maxX, maxY } = bounds ?? { minX: 0, minY: 0, maxX: 0, maxY: 0 };
    const [width, height] = [maxX - minX, maxY - minY];
    const count = Math.max(1, items.length);
    this.#side = Math.max(
      Math.sqrt((width * height) / count),
      // All in a row: not more squares than items.
      Math.max(width, height) / count,
      1e-6,
    );
    this.#minX = minX;
    this.#minY = minY;
    this.#columns = Math.floor(width / this.#side) + 1;
    this.#rows = Math.floor(height / this.#side) + 1;
    items.forEach((item, index) => {
      const [column, row] = this.#squareOf(item.at);
      const key = row * this.#columns + column;
      const entry = { item, index };
      const square = this.#squares.get(key);
      if (square) square.push(entry);
      else this.#squares.set(key, [entry]);
    });
  }

  #squareOf({ x, y }: MapPoint): readonly [number, number] {
    const at = (value: number, min: number, count: number): number =>
      Math.min(count - 1, Math.max(0, Math.floor((value - min) / this.#side)));
    return [at(x, this.#minX, this.#columns), at(y, this.#minY, this.#rows)];
  }

  /** All items that lie within a box of that half side about a point, and some around it. */
  *about(point: MapPoint, halfSide: number): Generator<Entry<T>> {
    const { x, y } = point;
    const [left, bottom] = this.#squareOf({ ...point, x: x - halfSide, y: y - halfSide });
    const [right, top] = this.#squareOf({ ...point, x: x + halfSide, y: y + halfSide });
    for (let row = bottom; row <= top; row++) {
      for (let column = left; column <= right; column++) {
        yield* this.#squares.get(row * this.#columns + column) ?? [];
      }
    }
  }
}

/** The item closest to a canvas point within `reach` pixels, of equals the last; null: none. */
export function nearest<T extends { readonly at: MapPoint }>(
  grid: Grid<T>,
  view: View,
  point: CanvasPoint,
  reach: number,
): T | null {
  let best: Entry<T> | null = null;
  let bestDistance = reach;
  for (const entry of grid.about(toMap(view, point), reach / view.scale)) {
    const { x, y } = toCanvas(view, entry.item.at);
    const distance = Math.hypot(x - point.x, y - point.y);
    if (distance > bestDistance) continue;
    if (distance === bestDistance && best && best.index > entry.index) continue;
    best = entry;
    bestDistance = distance;
  }
  return best?.item ?? null;
}
