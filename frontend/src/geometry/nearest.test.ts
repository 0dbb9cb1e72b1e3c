import { expect, test } from 'vitest';

import { canvasPoint, mapPoint } from './coordinates';
import { nearest } from './nearest';

const view = { x: 0, y: 100, scale: 10 };
const items = [
  { id: 'a', at: mapPoint(1, 1) },
  { id: 'b', at: mapPoint(2, 1) },
];

test('the closest within reach, by pixels', () => {
  expect(nearest(items, view, canvasPoint(18, 90), 16)?.id).toBe('b');
  expect(nearest(items, view, canvasPoint(11, 95), 16)?.id).toBe('a');
});

test('nothing beyond reach', () => {
  expect(nearest(items, view, canvasPoint(10, 40), 16)).toBeNull();
});
