/** Keeping pins clear of what stands on the map: buttons, scale bar, notices. */
import {
  fit,
  toCanvas,
  type Bounds,
  type Insets,
  type MapPoint,
  type Size,
  type View,
} from './coordinates';

/** An upright box in pixels; of the map view unless it says otherwise. */
export interface Box {
  readonly left: number;
  readonly top: number;
  readonly right: number;
  readonly bottom: number;
}

/** Half of the largest pin with its ring and its warning sign, pixels. */
const REACH_PX = 21;

/** Whether a pin there can be seen and clicked. */
export function isClear(view: View, point: MapPoint, covered: readonly Box[]): boolean {
  const { x, y } = toCanvas(view, point);
  return covered.every(
    ({ left, top, right, bottom }) =>
      x <= left - REACH_PX ||
      x >= right + REACH_PX ||
      y <= top - REACH_PX ||
      y >= bottom + REACH_PX,
  );
}

/**
 * The view that shows all of `bounds` and has no pin below a covered box: where one would be, the
 * largest of the views that leave a side free for each box.
 */
export function fitClear(
  bounds: Bounds,
  pins: readonly MapPoint[],
  size: Size,
  insets: Insets,
  covered: readonly Box[],
): View {
  const clear = (view: View): boolean => pins.every((pin) => isClear(view, pin, covered));
  const plain = fit(bounds, size, insets);
  if (clear(plain)) return plain;
  const views = covered
    .reduce<readonly Insets[]>(
      (all, box) =>
        all.flatMap((own) =>
          waysAround(box, size).map(([side, depth]) => ({
            ...own,
            [side]: Math.max(own[side], depth),
          })),
        ),
      [insets],
    )
    .map((own) => fit(bounds, size, own))
    .sort((a, b) => b.scale - a.scale);
  return views.find(clear) ?? plain;
}

/** The sides that a box leaves a third of the view to at least, and how deep it is from there. */
function waysAround(box: Box, { width, height }: Size): (readonly [keyof Insets, number])[] {
  const ways: (readonly [keyof Insets, number, number])[] = [
    ['top', box.bottom + REACH_PX, height],
    ['right', width - box.left + REACH_PX, width],
    ['bottom', height - box.top + REACH_PX, height],
    ['left', box.right + REACH_PX, width],
  ];
  return ways
    .filter(([, depth, extent]) => depth <= (extent * 2) / 3)
    .map(([side, depth]) => [side, depth] as const);
}
