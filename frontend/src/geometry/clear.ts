/** Keeps pins clear of elements over the map, and labels clear of each other. Pure. */
import {
  type Bounds,
  type Box,
  canvasPoint,
  type CanvasPoint,
  fit,
  type MapPoint,
  type Size,
  toCanvas,
  type View,
} from './coordinates';

/** Half of the largest pin with its ring and its warning sign, pixels. */
const REACH_PX = 21;

export function isClear(view: View, point: MapPoint, covered: readonly Box[]): boolean {
  const { x, y } = toCanvas(view, point);
  const pin = { left: x, top: y, right: x, bottom: y };
  return covered.every((box) => areApart(pin, box, REACH_PX));
}

const areApart = (a: Box, b: Box, gap: number): boolean =>
  a.right + gap <= b.left ||
  b.right + gap <= a.left ||
  a.bottom + gap <= b.top ||
  b.bottom + gap <= a.top;

/**
 * The view that shows all of `bounds` with no pin below a covered box: otherwise the largest of the
 * views that leave a side free for each box.
 */
export function fitClear(
  bounds: Bounds,
  pins: readonly MapPoint[],
  size: Size,
  insets: Box,
  covered: readonly Box[],
): View {
  const clear = (view: View): boolean => pins.every((pin) => isClear(view, pin, covered));
  const plain = fit(bounds, size, insets);
  if (clear(plain)) return plain;
  const views = covered
    .reduce<readonly Box[]>(
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

/** The sides at which a box leaves at least a third of the view free, and its depth from there. */
function waysAround(box: Box, { width, height }: Size): (readonly [keyof Box, number])[] {
  const ways: (readonly [keyof Box, number, number])[] = [
    ['top', box.bottom + REACH_PX, height],
    ['right', width - box.left + REACH_PX, width],
    ['bottom', height - box.top + REACH_PX, height],
    ['left', box.right + REACH_PX, width],
  ];
  return ways
    .filter(([, depth, extent]) => depth <= (extent * 2) / 3)
    .map(([side, depth]) => [side, depth] as const);
}

/**
 * Places labels without overlap: each tries its texts, longest first, at its places, and is left out if
 * none is free. Important labels come first. Works in pixels relative to the map's origin, so a pan
 * reuses the result.
 */

export interface LabelRequest {
  readonly id: string;
  /** Centre of the pin, pixels. */
  readonly x: number;
  readonly y: number;
  /** Half of the pin's size, pixels. */
  readonly radius: number;
  readonly priority: number;
  /** Texts, the most detailed first, each with its width in pixels. */
  readonly texts: readonly { readonly text: string; readonly width: number }[];
}

/** `x` and `y`: its top left corner, pixels. */
export type PlacedLabel = ReturnType<typeof placeLabels>[number];

/** Where labels may be seen: boxes in pixels relative to the map's origin. */
export interface Room {
  /** The visible part; labels of pins inside it are not cut off. */
  readonly within: Box;
  readonly covered: readonly Box[];
  /**
   * The robot's and other marks: labels keep clear of them, but a pin below one still has its label, and
   * a warning's value is worth more than a mark, or a distance to other pins.
   */
  readonly marks?: readonly Box[];
}

const GAP = 4;
/** From a label to another tag's pin: nearer, it would seem to be that pin's. */
const OTHER_GAP = 8;
/** Lowest priority of a warning. */
const URGENT = 3;
const BUCKET = 64;

export function placeLabels(
  requests: readonly LabelRequest[],
  height: number,
  room: Room | null = null,
) {
  const [taken, pins] = [new Buckets(), new Buckets()];
  const marks = room?.marks ?? [];
  for (const box of [...(room?.covered ?? []), ...marks]) taken.add(box);
  const ordered = requests
    .map((request, index) => {
      const { x, y } = request;
      const r = request.radius * 0.8;
      const pin: Box = { left: x - r, top: y - r, right: x + r, bottom: y + r };
      pins.add(pin);
      return { request, index, pin };
    })
    .sort((a, b) => b.request.priority - a.request.priority || a.index - b.index);

  return ordered.flatMap(({ request, pin }) => {
    // Among overlapping pins only warnings get labels: more would be unreadable.
    const isUrgent = request.priority >= URGENT;
    if (!isUrgent && !(pins.isFree(pin, [pin]) && taken.isFree(pin, marks))) return [];
    const rules = [(box: Box) => taken.isFree(box) && pins.isFree(box, [pin], OTHER_GAP)];
    if (isUrgent) rules.push((box) => taken.isFree(box, marks) && pins.isFree(box));
    const spot = firstFree(request, height, room?.within ?? null, rules);
    if (!spot) return [];
    const { text, box, width } = spot;
    taken.add(box);
    // The width is not right minus left: float noise would make it a pixel off.
    return [{ id: request.id, text, x: box.left, y: box.top, width }];
  });
}

function firstFree(
  { x, y, radius, texts }: LabelRequest,
  height: number,
  sight: Box | null,
  rules: readonly ((box: Box) => boolean)[],
): { text: string; width: number; box: Box } | null {
  const reach = radius + GAP;
  // From a round pin to a corner of its label.
  const near = reach * Math.SQRT1_2;
  const within = sight && contains(sight, { left: x, top: y, right: x, bottom: y }) ? sight : null;
  for (const { text, width } of texts) {
    const corners: readonly (readonly [number, number])[] = [
      [x + reach, y - height / 2],
      [x - reach - width, y - height / 2],
      [x - width / 2, y - reach - height],
      [x - width / 2, y + reach],
      [x + near, y - near - height],
      [x + near, y + near],
      [x - near - width, y - near - height],
      [x - near - width, y + near],
    ];
    const boxes = corners
      .map(([left, top]) => ({ left, top, right: left + width, bottom: top + height }))
      .filter((box) => !within || contains(within, box));
    const box = rules.map((isFree) => boxes.find(isFree)).find((each) => each !== undefined);
    if (box) return { text, width, box };
  }
  return null;
}

const contains = (outer: Box, inner: Box): boolean =>
  inner.left >= outer.left &&
  inner.top >= outer.top &&
  inner.right <= outer.right &&
  inner.bottom <= outer.bottom;

/** Boxes by the squares they touch, so that a thousand labels do not need a million checks. */
class Buckets {
  readonly #boxes = new Map<number, Box[]>();

  add(box: Box): void {
    for (const key of keys(box)) {
      const list = this.#boxes.get(key);
      if (list) list.push(box);
      else this.#boxes.set(key, [box]);
    }
  }

  isFree(box: Box, ignored: readonly Box[] = [], gap = 0): boolean {
    for (const key of keys(box, gap)) {
      for (const other of this.#boxes.get(key) ?? []) {
        if (!ignored.includes(other) && !areApart(box, other, gap)) return false;
      }
    }
    return true;
  }
}

/** Squares on one side of the map's origin: half a row. */
const HALF = 2 ** 25;

function* keys({ left, top, right, bottom }: Box, gap = 0): Generator<number> {
  const bucket = (at: number): number => Math.floor(at / BUCKET);
  for (let i = bucket(left - gap); i <= bucket(right + gap); i++) {
    for (let j = bucket(top - gap); j <= bucket(bottom + gap); j++) {
      yield (i + HALF) * 2 * HALF + j + HALF;
    }
  }
}

/** Distance between a pin and a box beside it, and to the map's edge, pixels. */
const GAP_PX = 10;
const EDGE_PX = 6;

const clamp = (value: number, most: number): number =>
  Math.max(EDGE_PX, Math.min(value, most - EDGE_PX));

/**
 * Upper left corner of a box beside a pin of half size `reach`: to its right if there is room, else
 * left, below or above; always within the view, if it is large enough.
 */
export function beside(pin: CanvasPoint, reach: number, box: Size, within: Size): CanvasPoint {
  const away = reach + GAP_PX;
  const x = clamp(pin.x - box.width / 2, within.width - box.width);
  const y = clamp(pin.y - box.height / 2, within.height - box.height);
  const right = pin.x + away;
  const left = pin.x - away - box.width;
  const below = pin.y + away;
  const above = pin.y - away - box.height;
  if (right + box.width <= within.width - EDGE_PX) return canvasPoint(right, y);
  if (left >= EDGE_PX) return canvasPoint(left, y);
  if (below + box.height <= within.height - EDGE_PX) return canvasPoint(x, below);
  return canvasPoint(x, Math.max(EDGE_PX, above));
}
