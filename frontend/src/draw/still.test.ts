import { describe, expect, test } from 'vitest';

import { mapPoint } from '../geometry/coordinates';
import { FakeContext } from '../testing/canvas';
import { estimated, fieldWith } from '../testing/field';
import { penOn } from '../testing/pen';
import {
  drawAreas,
  drawBoxes,
  drawEdges,
  drawGridLabels,
  drawPicture,
  floorOf,
  hatchedOf,
  Hatching,
  knownOf,
} from './still';
import { canvasOfPixels, newCanvas } from './surface';

describe('a picture in the map', () => {
  const placement = { originX: 0, originY: 0, yaw: 0, resolution: 0.5, width: 4, height: 4 };
  const picture = newCanvas(4, 4);

  test('cells that are larger than a pixel are never blurred', () => {
    const context = new FakeContext();
    drawPicture(penOn(context), { picture, placement });
    expect(context.named('drawImage')[0]?.state['imageSmoothingEnabled']).toBe(false);
  });

  test('cells that are smaller are averaged, or walls would drop out', () => {
    const context = new FakeContext();
    drawPicture(penOn(context), { picture, placement: { ...placement, resolution: 0.01 } });
    expect(context.named('drawImage')[0]?.state['imageSmoothingEnabled']).toBe(true);
  });
});

test('boxes close their outline at the right place', () => {
  const context = new FakeContext();
  const box = [mapPoint(0, 0), mapPoint(1, 0), mapPoint(1, 2)];
  drawBoxes(penOn(context), [box]);
  expect(context.named('moveTo')[0]?.args).toEqual([50, 250]);
  expect(context.named('lineTo').map(({ args }) => args)).toEqual([
    [90, 250],
    [90, 170],
  ]);
  expect(context.named('closePath')).toHaveLength(1);
});

test('an area is drawn round its tags, and has its name above it', () => {
  const context = new FakeContext();
  const places = [mapPoint(0, 0), mapPoint(1, 2)];
  drawAreas(penOn(context), [{ name: 'Bay 1', places }]);
  expect(context.named('strokeRect')[0]?.args).toEqual([40, 160, 60, 100]);
  expect(context.named('fillText')[0]?.args).toEqual(['Bay 1', 40, 157]);
});

test('the grid’s numbers are round metres at their lines', () => {
  const context = new FakeContext();
  drawGridLabels(penOn(context));
  const labels = context.named('fillText').map(({ args }) => args);
  const two = labels.find(([text, , y]) => text === '2 m' && y === 8);
  expect(two?.[1]).toBe(50 + 2 * 40 + 4);
  // Clear of the buttons, which are in a row on a wide map.
  const wide = new FakeContext();
  drawGridLabels(penOn(wide, { size: { width: 600, height: 250 } }));
  const along = wide.named('fillText').filter(({ args }) => args[2] === 8);
  expect(Math.max(...along.map(({ args }) => args[1] as number))).toBeLessThan(360);
});

test.each([1, 1.5, 2, 3])('the grid’s numbers keep apart at %d times the text', (textScale) => {
  const context = new FakeContext();
  drawGridLabels(penOn(context, { textScale }));
  const along = context
    .named('fillText')
    .filter(({ args }) => args[2] === 8)
    .map(({ args }) => args[1] as number);
  const gaps = along.slice(1).map((at, i) => at - (along[i] ?? 0));
  expect(Math.min(...gaps)).toBeGreaterThanOrEqual(56 * textScale);
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
  expect(pixelsOf(floorOf(new ImageData(map, 3, 1)))).toEqual([0, 255, 0]);
});

test('hatching covers the unknown inside of the greenhouse alone', () => {
  const picture = canvasOfPixels({ data: new Uint8ClampedArray(4), width: 1, height: 1 });
  const placement = { originX: 0, originY: 0, yaw: 0, resolution: 1, width: 1, height: 1 };
  const context = new FakeContext();
  const mask = { picture, placement };
  new Hatching().draw(penOn(context, { size: { width: 30, height: 20 }, ratio: 2 }), mask, mask);
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
  const [less, least, ...others] = hatchedOf(estimated([20, 20, 20, NaN], sd), null);
  expect([less, least].map((part) => part && pixelsOf(part.cells))).toEqual([
    [0, 255, 0, 0],
    [0, 0, 255, 0],
  ]);
  expect(others).toEqual([]);
  const strokes = (gap: number | undefined): number => {
    const context = new FakeContext();
    const placement = { originX: 0, originY: 0, yaw: 0, resolution: 1, width: 4, height: 1 };
    new Hatching().draw(penOn(context), { picture: newCanvas(1, 1), placement }, null, gap);
    const [drawn] = context.named('drawImage');
    return FakeContext.recordOf(drawn?.args[0] as HTMLCanvasElement)?.named('moveTo').length ?? 0;
  };
  // Each step is twice as dense, so that it contains all strokes of the previous one.
  expect(strokes(least?.gap)).toBeGreaterThan(3.6 * strokes(less?.gap));
});

test('what is too old to say is hatched where it is told at all', () => {
  const parts = hatchedOf(fieldWith([[20, 20, NaN]]), Uint8Array.of(0, 1, 1));
  expect(parts.map(({ cells }) => pixelsOf(cells))).toEqual([[0, 255, 0]]);
  expect(hatchedOf(fieldWith([[20]]), null)).toEqual([]);
});

test('an edge is drawn where it is in sight', () => {
  const context = new FakeContext(newCanvas(1, 1));
  const pen = penOn(context, { view: { x: 0, y: 50, scale: 10 } });
  drawEdges(pen, [1, 1, 2, 1, 500, 1, 501, 1]);
  expect(context.named('moveTo').map(({ args }) => args)).toEqual([[10, 40]]);
  expect(context.named('lineTo').map(({ args }) => args)).toEqual([[20, 40]]);
});
