import { expect, test } from 'vitest';

import { FakeContext } from '../testing/canvas';
import { estimated, sureness } from '../testing/estimate';
import { fieldWith } from '../testing/field';
import { LIGHT } from './palette';
import { canvasOfPixels, newCanvas } from './surface';
import { drawEdges, drawUnsure, floorOf, Hatching, knownOf, unsureOf } from './still';

const pixelsOf = (canvas: HTMLCanvasElement): number[] => {
  const [put] = FakeContext.recordOf(canvas)?.named('putImageData') ?? [];
  const { data } = put?.args[0] as ImageData;
  return [...data].filter((_, index) => index % 4 === 3);
};

test('what is known is so top row first, and the floor is what is no wall', () => {
  const known = knownOf(
    fieldWith([
      [1, NaN],
      [NaN, NaN],
    ]),
  );
  expect(pixelsOf(known)).toEqual([0, 0, 255, 0]);
  const map = Uint8ClampedArray.of(70, 0, 0, 255, 236, 0, 0, 255, 236, 0, 0, 0);
  expect(pixelsOf(floorOf(new ImageData(map, 3, 1), 153))).toEqual([0, 255, 0]);
});

test('hatching is cut to the inside of the house, and out of what is known', () => {
  const picture = canvasOfPixels({ data: new Uint8ClampedArray(4), width: 1, height: 1 });
  const placement = { originX: 0, originY: 0, yaw: 0, resolution: 1, width: 1, height: 1 };
  const context = new FakeContext();
  const surface = {
    context: context.asContext(),
    size: { width: 30, height: 20 },
    ratio: 2,
  };
  const mask = { picture, placement };
  const view = { x: 3, y: 4, scale: 10 };
  new Hatching().draw(surface, view, mask, mask, LIGHT);
  const [drawn] = context.named('drawImage');
  expect(drawn?.args.slice(1)).toEqual([0, 0, 30, 20]);
  const canvas = drawn?.args[0] as HTMLCanvasElement;
  expect([canvas.width, canvas.height]).toEqual([60, 40]);
  const record = FakeContext.recordOf(canvas);
  expect(record?.named('stroke')[0]?.state['globalCompositeOperation']).toBe('source-over');
  expect(record?.named('drawImage').map(({ state }) => state['globalCompositeOperation'])).toEqual([
    'destination-in',
    'destination-out',
  ]);
});

test('what an estimate is unsure of is hatched, the denser the less it is sure', () => {
  const sd = [0.5, 1.1, 1.4, 2];
  const parts = unsureOf(estimated([20, 20, 20, NaN], sd), sureness(sd));
  expect(parts.map((part) => part && pixelsOf(part))).toEqual([
    [0, 255, 0, 0],
    null,
    [0, 0, 255, 0],
  ]);
  const strokes = (index: number): number => {
    const context = new FakeContext();
    const surface = { context: context.asContext(), size: { width: 90, height: 90 }, ratio: 1 };
    const placement = { originX: 0, originY: 0, yaw: 0, resolution: 1, width: 4, height: 1 };
    const picture = newCanvas(1, 1);
    const steps = [0, 1, 2].map((each) => (each === index ? { picture, placement } : null));
    drawUnsure(surface, { x: 0, y: 0, scale: 10 }, steps, new Hatching(), LIGHT);
    const [drawn] = context.named('drawImage');
    return FakeContext.recordOf(drawn?.args[0] as HTMLCanvasElement)?.named('moveTo').length ?? 0;
  };
  expect(strokes(1)).toBeGreaterThan(1.8 * strokes(0));
  expect(strokes(2)).toBeGreaterThan(1.8 * strokes(1));
});

test('an edge is drawn where it is in sight', () => {
  const context = new FakeContext(newCanvas(1, 1));
  const surface = { context: context.asContext(), size: { width: 100, height: 100 }, ratio: 1 };
  drawEdges(surface, { x: 0, y: 50, scale: 10 }, [1, 1, 2, 1, 500, 1, 501, 1], LIGHT);
  expect(context.named('moveTo').map(({ args }) => args)).toEqual([[10, 40]]);
  expect(context.named('lineTo').map(({ args }) => args)).toEqual([[20, 40]]);
});
