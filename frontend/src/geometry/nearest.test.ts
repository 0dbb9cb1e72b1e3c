import { expect, test } from 'vitest';

import { canvasPoint, mapPoint, toCanvas, type MapPoint } from './coordinates';
import { Grid, nearest } from './nearest';

const view = { x: 0, y: 100, scale: 10 };
const items = new Grid([
  { id: 'a', at: mapPoint(1, 1) },
  { id: 'b', at: mapPoint(2, 1) },
]);

test('the closest within reach, by pixels', () => {
  expect(nearest(items, view, canvasPoint(18, 90), 16)?.id).toBe('b');
  expect(nearest(items, view, canvasPoint(11, 95), 16)?.id).toBe('a');
});

test('nothing beyond reach, and what lies at it', () => {
  expect(nearest(items, view, canvasPoint(10, 40), 16)).toBeNull();
  expect(nearest(items, view, canvasPoint(10, 74), 16)?.id).toBe('a');
  expect(nearest(items, view, canvasPoint(10, 73.9), 16)).toBeNull();
});

test('of two at one place the one that is drawn last', () => {
  const at = mapPoint(1, 1);
  const pile = new Grid([
    { id: 'below', at },
    { id: 'above', at },
  ]);
  expect(nearest(pile, view, canvasPoint(10, 90), 16)?.id).toBe('above');
});

test('none of none', () => {
  expect(nearest(new Grid([]), view, canvasPoint(0, 0), 16)).toBeNull();
});

/** Numbers from 0 to 1 that are the same each time. */
function* chance(): Generator<number> {
  for (let seed = 1; ; seed = (seed * 48_271) % 2_147_483_647) yield seed / 2_147_483_647;
}

test.each([
  ['a crowd', 20, 20],
  ['a row', 20, 0],
  ['a column', 0, 20],
  ['far apart', 1e6, 1e6],
])('%s is searched as if one by one', (_, width, height) => {
  const random = chance();
  const next = (): number => random.next().value as number;
  const points = Array.from({ length: 400 }, () => ({
    at: mapPoint((next() - 0.5) * width, (next() - 0.5) * height),
  }));
  const grid = new Grid(points);
  const scale = 600 / Math.max(width, height);
  const wide = { x: 300, y: 300, scale };
  for (let i = 0; i < 200; i++) {
    const mouse = canvasPoint(next() * 700 - 50, next() * 700 - 50);
    const far = (at: MapPoint): number => {
      const { x, y } = toCanvas(wide, at);
      return Math.hypot(x - mouse.x, y - mouse.y);
    };
    const best = points.reduce((a, b) => (far(b.at) < far(a.at) ? b : a));
    expect(nearest(grid, wide, mouse, 16)).toBe(far(best.at) <= 16 ? best : null);
  }
});

test('a look about one of many looks at few', () => {
  const many = Array.from({ length: 10_000 }, (_, i) => ({
    at: mapPoint(i % 100, Math.floor(i / 100)),
  }));
  expect([...new Grid(many).about(mapPoint(50, 50), 1)].length).toBeLessThan(30);
});
