import { describe, expect, test } from 'vitest';

import { mapPoint } from '../geometry/coordinates';
import { FakeContext } from '../testing/canvas';
import { estimated, fieldWith, sureness } from '../testing/field';
import { DARK, LIGHT } from './palette';
import {
  drawBoxes,
  drawEdges,
  drawGridLabels,
  drawPicture,
  drawUnsure,
  fieldPlacement,
  floorOf,
  Hatching,
  knownOf,
  unsureOf,
} from './still';
import { canvasOfPixels, newCanvas } from './surface';

const surface = (context: FakeContext): Parameters<typeof drawPicture>[0] => ({
  context: context.asContext(),
  size: { width: 400, height: 300 },
  ratio: 1,
});
const view = { x: 50, y: 250, scale: 40 };

describe('a picture in the map', () => {
  const placement = { originX: 0, originY: 0, yaw: 0, resolution: 0.5, width: 4, height: 4 };

  test('cells that are larger than a pixel are never blurred', () => {
    const context = new FakeContext();
    drawPicture(surface(context), view, newCanvas(4, 4), placement);
    expect(context.named('drawImage')[0]?.state['imageSmoothingEnabled']).toBe(false);
  });

  test('cells that are smaller are averaged, or walls would drop out', () => {
    const context = new FakeContext();
    drawPicture(surface(context), view, newCanvas(4, 4), { ...placement, resolution: 0.01 });
    expect(context.named('drawImage')[0]?.state['imageSmoothingEnabled']).toBe(true);
  });
});

test('a field lies where it says, whatever its picture’s detail', () => {
  const field = {
    sensor: 't',
    width: 10,
    height: 20,
    originX: -1,
    originY: 2,
    resolution: 0.1,
    valueMin: 0,
    valueMax: 1,
    sampleCount: 1,
    values: new Float32Array(200),
  };
  const placement = fieldPlacement(field, newCanvas(40, 80));
  expect(placement).toMatchObject({ originX: -1, originY: 2, yaw: 0, width: 40, height: 80 });
  expect(placement.resolution * placement.width).toBeCloseTo(1);
});

test('boxes close their outline at the right place', () => {
  const context = new FakeContext();
  const box = [mapPoint(0, 0), mapPoint(1, 0), mapPoint(1, 2)];
  drawBoxes(surface(context), view, [box], LIGHT);
  expect(context.named('moveTo')[0]?.args).toEqual([50, 250]);
  expect(context.named('lineTo').map(({ args }) => args)).toEqual([
    [90, 250],
    [90, 170],
  ]);
  expect(context.named('closePath')).toHaveLength(1);
});

test('the grid’s numbers are round metres at their lines', () => {
  const context = new FakeContext();
  drawGridLabels(surface(context), view, LIGHT);
  const labels = context.named('fillText').map(({ args }) => args);
  const two = labels.find(([text, , y]) => text === '2 m' && y === 8);
  expect(two?.[1]).toBe(50 + 2 * 40 + 4);
});

test.each([1, 1.5, 2, 3])('the grid’s numbers keep apart at %d times the text', (textScale) => {
  const context = new FakeContext();
  drawGridLabels(surface(context), view, LIGHT, textScale);
  const along = context
    .named('fillText')
    .filter(({ args }) => args[2] === 8)
    .map(({ args }) => args[1] as number);
  const gaps = along.slice(1).map((at, i) => at - (along[i] ?? 0));
  expect(Math.min(...gaps)).toBeGreaterThanOrEqual(56 * textScale);
});

test('text on the map can be read in both themes', () => {
  for (const palette of [LIGHT, DARK]) {
    const ink = Number(/\d+/.exec(palette.labelText)?.[0]);
    const ground = Number(/\d+/.exec(palette.labelFill)?.[0]);
    expect(Math.abs(ink - ground)).toBeGreaterThan(180);
  }
});

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
