import { describe, expect, test } from 'vitest';

import {
  beside,
  fitClear,
  isClear,
  type LabelRequest,
  type PlacedLabel,
  placeLabels,
} from './clear';
import {
  type Box,
  type Bounds,
  boundsOf,
  canvasPoint,
  corners,
  fit,
  mapPoint,
  toCanvas,
} from './coordinates';

const insets = { top: 26, right: 60, bottom: 40, left: 26 };
const bounds: Bounds = { minX: 0, minY: 0, maxX: 6, maxY: 6 };
const pins = corners(bounds);
/** A row of buttons in the upper right corner of a low map. */
const low = { width: 500, height: 240 };
const row: Box = { left: 300, top: 10, right: 490, bottom: 56 };
/** The same buttons in a column. */
const high = { width: 500, height: 700 };
const column: Box = { left: 444, top: 10, right: 490, bottom: 200 };

describe('a fit', () => {
  test('is the plain one where no pin is in the way', () => {
    expect(fitClear(bounds, pins, high, { ...insets, right: 80 }, [column])).toEqual(
      fit(bounds, high, { ...insets, right: 80 }),
    );
    expect(fitClear(bounds, [], low, insets, [row])).toEqual(fit(bounds, low, insets));
  });

  test.each([
    ['row', low, [row]],
    ['column', { width: 500, height: 500 }, [column]],
    ['row and notice', low, [row, { left: 0, top: 205, right: 500, bottom: 240 }]],
  ] as const)('has no pin below a %s, and shows them all', (_, size, covered) => {
    const wide = boundsOf([mapPoint(0, 0), mapPoint(14, 6)]) ?? bounds;
    const all = corners(wide);
    expect(all.every((pin) => isClear(fit(wide, size, insets), pin, covered))).toBe(false);
    const view = fitClear(wide, all, size, insets, covered);
    for (const pin of all) {
      expect(isClear(view, pin, covered)).toBe(true);
      const { x, y } = toCanvas(view, pin);
      expect(x > 0 && x < size.width && y > 0 && y < size.height).toBe(true);
    }
  });

  test('gives way on the side that costs less', () => {
    // Flat: there is room below the row. Tall: there is room beside the column.
    const flat = { minX: 0, minY: 0, maxX: 14, maxY: 3 };
    const tall = { minX: 0, minY: 0, maxX: 6, maxY: 9 };
    const below = fitClear(flat, corners(flat), low, { ...insets, left: 200 }, [row]);
    expect(below.scale).toBeCloseTo(fit(flat, low, { ...insets, left: 200, top: 77 }).scale);
    const beside = fitClear(tall, corners(tall), { width: 500, height: 500 }, insets, [column]);
    expect(beside.scale).toBeCloseTo(
      fit(tall, { width: 500, height: 500 }, { ...insets, right: 77 }).scale,
    );
  });

  test('that cannot be clear is the plain one', () => {
    const all: Box = { left: 0, top: 0, right: 500, bottom: 240 };
    expect(fitClear(bounds, pins, low, insets, [all])).toEqual(fit(bounds, low, insets));
  });
});

test('a pin is clear from its own reach on', () => {
  const view = { x: 0, y: 0, scale: 1 };
  const box: Box = { left: 100, top: 100, right: 200, bottom: 200 };
  expect(isClear(view, mapPoint(79, -150), [box])).toBe(true);
  expect(isClear(view, mapPoint(79.5, -150), [box])).toBe(false);
  expect(isClear(view, mapPoint(150, -221), [box])).toBe(true);
  expect(isClear(view, mapPoint(150, -220), [box])).toBe(false);
});

const HEIGHT = 18;

const request = (over: Partial<LabelRequest>): LabelRequest => ({
  id: 'a',
  x: 0,
  y: 0,
  radius: 8,
  priority: 0,
  texts: [
    { text: 'a · 21.5 °C', width: 70 },
    { text: 'a', width: 14 },
  ],
  ...over,
});

const overlap = (a: PlacedLabel, b: PlacedLabel): boolean =>
  a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + HEIGHT && b.y < a.y + HEIGHT;

describe('labels', () => {
  test('one alone stands to the right of its pin with its long text', () => {
    const [label] = placeLabels([request({})], HEIGHT);
    expect(label).toMatchObject({ text: 'a · 21.5 °C', x: 12, y: -9 });
  });

  test('one beside the edge or the buttons goes where it can be seen', () => {
    const within = { left: -200, top: -200, right: 40, bottom: 200 };
    const [atEdge] = placeLabels([request({})], HEIGHT, { within, covered: [] });
    expect(atEdge).toMatchObject({ text: 'a · 21.5 °C', x: -82 });
    const buttons = { left: -100, top: -100, right: -20, bottom: 100 };
    const [between] = placeLabels([request({})], HEIGHT, { within, covered: [buttons] });
    expect(between).toMatchObject({ text: 'a', x: 12 });
    // Out of sight anyway, until the map is panned.
    const [beyond] = placeLabels([request({ x: 50 })], HEIGHT, { within, covered: [] });
    expect(beyond).toMatchObject({ text: 'a · 21.5 °C', x: 62 });
  });

  test('a crowd never overlaps, and still shows a good part of itself', () => {
    const crowd = Array.from({ length: 60 }, (_, i) =>
      request({ id: String(i), x: (i % 10) * 40, y: Math.floor(i / 10) * 30 }),
    );
    const placed = placeLabels(crowd, HEIGHT);
    expect(placed.length).toBeGreaterThan(20);
    for (const a of placed) {
      for (const b of placed) if (a !== b) expect(overlap(a, b)).toBe(false);
    }
  });

  test('where it is tight the shorter text is taken', () => {
    const wall = [-1, 1].map((side) => request({ id: `w${side}`, x: side * 50, texts: [] }));
    const [label] = placeLabels([request({ y: 0 }), ...wall], HEIGHT).filter((l) => l.id === 'a');
    expect(label?.text).toBe('a · 21.5 °C');
    const ring = [-40, 40].flatMap((x) =>
      [-26, 0, 26].map((y) => request({ id: `r${x},${y}`, x, y, texts: [] })),
    );
    const [tight] = placeLabels([request({}), ...ring], HEIGHT);
    expect(tight?.text).toBe('a');
  });

  test('a warning keeps its value over marks that leave no room beside them; others do not', () => {
    const within = { left: -200, top: -200, right: 200, bottom: 200 };
    const room = { within, covered: [], marks: [{ left: -20, top: -40, right: 30, bottom: 40 }] };
    const text = (priority: number): string | undefined =>
      placeLabels([request({ priority })], HEIGHT, room)[0]?.text;
    expect([text(6), text(2)]).toEqual(['a · 21.5 °C', undefined]);
  });

  test('the important one is placed first', () => {
    const both = [request({ id: 'low' }), request({ id: 'high', x: 2, priority: 5 })];
    expect(placeLabels(both, HEIGHT)[0]?.id).toBe('high');
  });

  test.each([
    ['does not cover another pin', 30, 0],
    ['does not stand nearer to another pin than to its own', 40, 20],
  ])('a label %s', (_, x, y) => {
    const [label] = placeLabels([request({}), request({ id: 'b', x, y, texts: [] })], HEIGHT);
    expect(label?.x).toBeLessThan(0);
  });
});

const box = { width: 200, height: 120 };
const within = { width: 600, height: 400 };

test.each([
  ['in the middle', 300, 200, 'right'],
  ['near the right edge', 560, 200, 'left'],
  ['in the upper left corner', 5, 5, 'right'],
  ['in the lower right corner', 595, 395, 'left'],
])('%s it stands inside the map and off the pin', (_, x, y, side) => {
  const at = beside(canvasPoint(x, y), 11, box, within);
  expect(at.x).toBeGreaterThanOrEqual(0);
  expect(at.y).toBeGreaterThanOrEqual(0);
  expect(at.x + box.width).toBeLessThanOrEqual(within.width);
  expect(at.y + box.height).toBeLessThanOrEqual(within.height);
  if (side === 'right') expect(at.x).toBeGreaterThan(x + 11);
  else expect(at.x + box.width).toBeLessThan(x - 11);
});

test('in a narrow map it goes below the pin, and above where there is no room below', () => {
  const narrow = { width: 300, height: 400 };
  expect(beside(canvasPoint(150, 100), 11, box, narrow).y).toBeGreaterThan(111);
  const above = beside(canvasPoint(150, 350), 11, box, narrow);
  expect(above.y + box.height).toBeLessThan(339);
  expect(above.x).toBe(50);
});
