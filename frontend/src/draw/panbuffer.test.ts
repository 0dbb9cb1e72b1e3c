import { describe, expect, test, vi } from 'vitest';

import { FakeContext } from '../testing/canvas';
import { PanBuffer, type Surface } from './surface';

function setUp(): {
  draw: (x: number, y: number, scale?: number) => void;
  paint: ReturnType<typeof vi.fn>;
  screen: FakeContext;
  buffer: PanBuffer;
} {
  const screen = new FakeContext();
  const surface: Surface = {
    context: screen.asContext(),
    size: { width: 300, height: 200 },
    ratio: 2,
  };
  const buffer = new PanBuffer();
  const paint = vi.fn();
  const draw = (x: number, y: number, scale = 10): void => {
    buffer.draw(surface, { x, y, scale }, paint as never);
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
