/**
 * Placing labels so that they do not pile up: each tries its longest text and its places in
 * turn, and is left out when nothing is free. Important ones come first. Works in pixels
 * relative to the map's origin, so a pan reuses the result.
 */
import type { Box } from './clear';

export interface LabelRequest {
  readonly id: string;
  /** Centre of the pin, pixels. */
  readonly x: number;
  readonly y: number;
  /** Half of the pin's size, pixels. */
  readonly radius: number;
  /** Higher is placed first. */
  readonly priority: number;
  /** Texts from the most to the least telling, each with its width in pixels. */
  readonly texts: readonly { readonly text: string; readonly width: number }[];
}

export interface PlacedLabel {
  readonly id: string;
  readonly text: string;
  /** Top left corner, pixels. */
  readonly x: number;
  readonly y: number;
  readonly width: number;
}

/** Where labels may be seen: boxes in pixels relative to the map's origin. */
export interface Room {
  /** What is in sight; a label of a pin in there is not cut off. */
  readonly within: Box;
  /** Buttons and the like. */
  readonly covered: readonly Box[];
}

const GAP = 4;
/** Priority of the least that needs somebody. */
const URGENT = 3;
const BUCKET = 64;

export function placeLabels(
  requests: readonly LabelRequest[],
  height: number,
  room: Room | null = null,
): PlacedLabel[] {
  const taken = new Buckets();
  for (const box of room?.covered ?? []) taken.add(box);
  const ordered = requests
    .map((request, index) => {
      const { x, y } = request;
      const r = request.radius * 0.8;
      const pin: Box = { left: x - r, top: y - r, right: x + r, bottom: y + r };
      taken.add(pin);
      return { request, index, pin };
    })
    .sort((a, b) => b.request.priority - a.request.priority || a.index - b.index);

  const placed: PlacedLabel[] = [];
  for (const { request, pin } of ordered) {
    // Among pins that overlap only those that need somebody: of more labels none would be read.
    if (request.priority < URGENT && !taken.isFree(pin, pin)) continue;
    const spot = firstFree(request, height, taken, room?.within ?? null);
    if (!spot) continue;
    taken.add(spot.box);
    placed.push({
      id: request.id,
      text: spot.text,
      x: spot.box.left,
      y: spot.box.top,
      // Not right less left, which is off by float noise and so by a pixel.
      width: spot.width,
    });
  }
  return placed;
}

function firstFree(
  { x, y, radius, texts }: LabelRequest,
  height: number,
  taken: Buckets,
  sight: Box | null,
): { text: string; width: number; box: Box } | null {
  const reach = radius + GAP;
  const within = sight && contains(sight, { left: x, top: y, right: x, bottom: y }) ? sight : null;
  for (const { text, width } of texts) {
    const corners: readonly (readonly [number, number])[] = [
      [x + reach, y - height / 2],
      [x - reach - width, y - height / 2],
      [x - width / 2, y - reach - height],
      [x - width / 2, y + reach],
    ];
    for (const [left, top] of corners) {
      const box = { left, top, right: left + width, bottom: top + height };
      if ((!within || contains(within, box)) && taken.isFree(box)) return { text, width, box };
    }
  }
  return null;
}

const contains = (outer: Box, inner: Box): boolean =>
  inner.left >= outer.left &&
  inner.top >= outer.top &&
  inner.right <= outer.right &&
  inner.bottom <= outer.bottom;

/** Boxes by the squares they touch, so that a thousand labels do not cost a million checks. */
class Buckets {
  readonly #boxes = new Map<number, Box[]>();

  add(box: Box): void {
    for (const key of keys(box)) {
      const list = this.#boxes.get(key);
      if (list) list.push(box);
      else this.#boxes.set(key, [box]);
    }
  }

  /** `own`: a box in there that does not count. */
  isFree(box: Box, own: Box | null = null): boolean {
    for (const key of keys(box)) {
      for (const other of this.#boxes.get(key) ?? []) {
        const apart =
          other === own ||
          box.right <= other.left ||
          other.right <= box.left ||
          box.bottom <= other.top ||
          other.bottom <= box.top;
        if (!apart) return false;
      }
    }
    return true;
  }
}

/** Squares on one side of the map's origin, and so half of those in a row. */
const HALF = 2 ** 25;

function* keys(box: Box): Generator<number> {
  for (let i = Math.floor(box.left / BUCKET); i <= Math.floor(box.right / BUCKET); i++) {
    for (let j = Math.floor(box.top / BUCKET); j <= Math.floor(box.bottom / BUCKET); j++) {
      yield (i + HALF) * 2 * HALF + j + HALF;
    }
  }
}
