import { expect, test } from 'vitest';

import { mapPoint } from '../geometry/coordinates';
import { FakeContext } from '../testing/canvas';
import { drawCrosshair, drawMark, drawPulses, pinRadius, PULSE_MS } from './pins';
import { LIGHT } from './palette';

const view = { x: 0, y: 100, scale: 50 };
const set = (): { context: FakeContext; surface: Parameters<typeof drawPulses>[0] } => {
  const context = new FakeContext();
  return {
    context,
    surface: { context: context.asContext(), size: { width: 101, height: 61 }, ratio: 1 },
  };
};

test('a pulse grows and vanishes', () => {
  const { context, surface } = set();
  const at = mapPoint(1, 1);
  for (const now of [0, PULSE_MS / 2, PULSE_MS]) {
    drawPulses(surface, view, [{ at, since: 0 }], now, LIGHT);
  }
  const arcs = context.named('arc');
  const radii = arcs.map(({ args }) => args[2] as number);
  expect(radii).toEqual([...radii].sort((a, b) => a - b));
  expect(arcs.map(({ state }) => state['globalAlpha'])).toEqual([1, 0.5, 0]);
  expect(arcs[0]?.args.slice(0, 2)).toEqual([50, 50]);
});

test('the mark surrounds its pin', () => {
  const { context, surface } = set();
  drawMark(surface, view, mapPoint(1, 1), true, LIGHT);
  const [x, y, radius] = (context.named('arc')[0]?.args ?? []) as number[];
  expect([x, y]).toEqual([50, 50]);
  // With the ring of a pest in it.
  expect(radius).toBeGreaterThan(pinRadius(50) + 7);
});

test('the crosshair is in the middle', () => {
  const { context, surface } = set();
  drawCrosshair(surface, LIGHT);
  const [, y] = (context.named('moveTo')[0]?.args ?? []) as number[];
  expect(Math.abs((y ?? NaN) - 61 / 2)).toBeLessThanOrEqual(1);
});
