import { describe, expect, test, vi } from 'vitest';

import { FakeContext } from '../testing/canvas';
import { penOn } from '../testing/pen';
import { clear, newCanvas, PanBuffer, Sprites } from './surface';

test('a sprite is painted once, at the screen’s pixel ratio', () => {
  const sprites = new Sprites(2);
  const paint = vi.fn();
  const first = sprites.get('a', 10, 6, paint);
  expect(sprites.get('a', 10, 6, paint)).toBe(first);
  expect(paint).toHaveBeenCalledTimes(1);
  expect([first.width, first.height]).toEqual([20, 12]);
});

test('the cache does not grow without end', () => {
  const sprites = new Sprites(1);
  const paint = vi.fn();
  for (let key = 0; key <= 1_000; key++) sprites.get(String(key), 1, 1, paint);
  sprites.get('0', 1, 1, paint);
  expect(paint).toHaveBeenCalledTimes(1_002);
});

test('a copy lands on whole device pixels', () => {
  const context = new FakeContext();
  new Sprites(2).draw(penOn(context, { ratio: 2 }), newCanvas(4, 4), 1.3, 2.74);
  expect(context.named('drawImage')[0]?.args.slice(1)).toEqual([1.5, 2.5, 2, 2]);
});

test('clearing goes back to CSS pixels', () => {
  const context = new FakeContext();
  clear(penOn(context, { size: { width: 9, height: 7 }, ratio: 3 }));
  expect(context.named('setTransform')[0]?.args).toEqual([3, 0, 0, 3, 0, 0]);
  expect(context.named('clearRect')[0]?.args).toEqual([0, 0, 9, 7]);
});

test('no canvas is empty', () => {
  expect(newCanvas(0, 0).width).toBe(1);
});

function setUp(): {
  draw: (x: number, y: number, scale?: number) => void;
  paint: ReturnType<typeof vi.fn>;
  screen: FakeContext;
  buffer: PanBuffer;
} {
  const screen = new FakeContext();
  const size = { width: 300, height: 200 };
  const buffer = new PanBuffer();
  const paint = vi.fn();
  const draw = (x: number, y: number, scale = 10): void => {
    buffer.draw(penOn(screen, { size, ratio: 2, view: { x, y, scale } }), paint as never);
  };
  return { draw, paint, screen, buffer };
}

describe('pan buffer', () => {
  test('a still view is painted directly', () => {
    const { draw, paint, screen } = setUp();
    draw(0, 0);
    draw(0, 0);
    expect(paint).toHaveBeenCalledTimes(2);
    expect(screen.named('drawImage')).toHaveLength(0);
  });

  test('a pan paints once and then only shifts, by device pixels', () => {
    const { draw, paint, screen } = setUp();
    draw(0, 0);
    draw(5, 0);
    draw(8, -3);
    draw(11, -7);
    expect(paint).toHaveBeenCalledTimes(2);
    const shifts = screen.named('drawImage').map(({ args }) => args.slice(1));
    expect(shifts).toEqual([
      [-320, -320],
      [-314, -326],
      [-308, -334],
    ]);
  });

  test('beyond its margin it is painted anew', () => {
    const { draw, paint } = setUp();
    draw(0, 0);
    draw(5, 0);
    draw(500, 0);
    expect(paint).toHaveBeenCalledTimes(3);
  });

  test('a zoom and new data are painted anew', () => {
    const { draw, paint, buffer } = setUp();
    draw(0, 0);
    draw(5, 0);
    draw(5, 0, 20);
    expect(paint).toHaveBeenCalledTimes(3);
    draw(6, 0, 20);
    buffer.spoil();
    draw(7, 0, 20);
    expect(paint).toHaveBeenCalledTimes(5);
  });
});
