import { expect, test, vi } from 'vitest';

import { FakeContext } from '../testing/canvas';
import { clear, newCanvas, Sprites } from './surface';

test('a sprite is painted once, at the screen’s pixel ratio', () => {
  const sprites = new Sprites(2);
  const paint = vi.fn();
  const first = sprites.get('a', 10, 6, paint);
  expect(sprites.get('a', 10, 6, paint)).toBe(first);
  expect(paint).toHaveBeenCalledTimes(1);
  expect([first.width, first.height]).toEqual([20, 12]);
});

test('the cache does not grow without end', () => {
  const sprites = new Sprites(1, 3);
  const paint = vi.fn();
  for (const key of ['a', 'b', 'c', 'd', 'a']) sprites.get(key, 1, 1, paint);
  expect(paint).toHaveBeenCalledTimes(5);
});

test('a copy lands on whole device pixels', () => {
  const context = new FakeContext();
  const surface = { context: context.asContext(), size: { width: 9, height: 9 }, ratio: 2 };
  new Sprites(2).draw(surface, newCanvas(4, 4), 1.3, 2.74);
  expect(context.named('drawImage')[0]?.args.slice(1)).toEqual([1.5, 2.5, 2, 2]);
});

test('clearing goes back to CSS pixels', () => {
  const context = new FakeContext();
  clear({ context: context.asContext(), size: { width: 9, height: 7 }, ratio: 3 });
  expect(context.named('setTransform')[0]?.args).toEqual([3, 0, 0, 3, 0, 0]);
  expect(context.named('clearRect')[0]?.args).toEqual([0, 0, 9, 7]);
});

test('no canvas is empty', () => {
  expect(newCanvas(0, 0).width).toBe(1);
});
