import { describe, expect, test } from 'vitest';

import {
  boundsOf,
  cameraOf,
  canvasPoint,
  corners,
  fit,
  gridStep,
  lengthText,
  mapPoint,
  MAX_SCALE,
  nearest,
  niceFloor,
  scaleBar,
  toCanvas,
  toMap,
  viewOf,
} from './coordinates';

const view = { x: 100, y: 300, scale: 50 };

describe('map and canvas', () => {
  test('y grows upwards in the map and downwards on the canvas', () => {
    expect(toCanvas(view, mapPoint(1, 2))).toEqual({ x: 150, y: 200 });
    expect(toCanvas(view, mapPoint(1, 3)).y).toBeLessThan(toCanvas(view, mapPoint(1, 2)).y);
  });
});

describe('fit', () => {
  const size = { width: 600, height: 800 };
  const insets = { top: 10, right: 60, bottom: 40, left: 20 };
  const bounds = { minX: -1, minY: 0, maxX: 3, maxY: 8 };

  test('shows all of the bounds within what the insets leave', () => {
    const fitted = fit(bounds, size, insets);
    for (const corner of corners(bounds)) {
      const { x, y } = toCanvas(fitted, corner);
      expect(x).toBeGreaterThanOrEqual(insets.left - 1e-9);
      expect(x).toBeLessThanOrEqual(size.width - insets.right + 1e-9);
      expect(y).toBeGreaterThanOrEqual(insets.top - 1e-9);
      expect(y).toBeLessThanOrEqual(size.height - insets.bottom + 1e-9);
    }
  });

  test('a single tag is not magnified without end', () => {
    const dot = { minX: 2, minY: 2, maxX: 2, maxY: 2 };
    expect(fit(dot, size, insets).scale).toBeLessThan(MAX_SCALE);
  });
});

test('bounds of points, and of none', () => {
  expect(boundsOf([mapPoint(1, 5), mapPoint(-2, 3)])).toEqual({
    minX: -2,
    minY: 3,
    maxX: 1,
    maxY: 5,
  });
  expect(boundsOf([])).toBeNull();
});

describe('a camera does not depend on the screen', () => {
  test('it survives the way to a view and back', () => {
    const size = { width: 600, height: 800 };
    const camera = { x: 1.5, y: 4, span: 6 };
    const back = cameraOf(viewOf(camera, size), size);
    expect(back.x).toBeCloseTo(1.5);
    expect(back.y).toBeCloseTo(4);
    expect(back.span).toBeCloseTo(6);
  });

  test('on another screen it has the same centre and the same metres across', () => {
    const small = { width: 300, height: 200 };
    const shown = viewOf({ x: 1.5, y: 4, span: 6 }, small);
    expect(toMap(shown, canvasPoint(150, 100))).toEqual({ x: 1.5, y: 4 });
    expect(200 / shown.scale).toBeCloseTo(6);
  });
});

describe('nearest', () => {
  const view = { x: 0, y: 100, scale: 10 };
  const items = [
    { id: 'a', at: mapPoint(1, 1) },
    { id: 'b', at: mapPoint(2, 1) },
  ];

  test('the closest within reach, by pixels', () => {
    expect(nearest(items, view, canvasPoint(18, 90), 16)?.id).toBe('b');
    expect(nearest(items, view, canvasPoint(11, 95), 16)?.id).toBe('a');
  });

  test('of two at one place the one that is drawn last', () => {
    const at = mapPoint(1, 1);
    const pile = [
      { id: 'below', at },
      { id: 'above', at },
    ];
    expect(nearest(pile, view, canvasPoint(10, 90), 16)?.id).toBe('above');
  });
});

test.each([
  [1, 1],
  [1.9, 1],
  [2, 2],
  [4.99, 2],
  [73, 50],
  [0.034, 0.02],
])('round length not above %d is %d', (value, expected) => {
  expect(niceFloor(value)).toBeCloseTo(expected);
});

describe('scale bar', () => {
  test('is never longer than allowed and says its true length', () => {
    for (const scale of [4, 13, 50, 99, 1234]) {
      const { metres, pixels } = scaleBar(scale, 110);
      expect(pixels).toBeLessThanOrEqual(110);
      expect(pixels).toBeCloseTo(metres * scale);
    }
  });
});

describe('grid', () => {
  test('lines keep their distance, and no more than about twice of it', () => {
    for (const scale of [4, 13, 50, 99, 180, 1234]) {
      const pixels = gridStep(scale, 56) * scale;
      expect(pixels).toBeGreaterThanOrEqual(56 - 1e-9);
      expect(pixels).toBeLessThanOrEqual(56 * 2.5 + 1e-9);
    }
  });
});

test.each([
  [0.05, '5 cm'],
  [0.5, '50 cm'],
  [1, '1 m'],
  [20, '20 m'],
  [5000, '5 km'],
])('%d m reads %s', (metres, text) => {
  expect(lengthText(metres)).toBe(text);
});
