import { describe, expect, test } from 'vitest';

import { mapPoint } from '../geometry/coordinates';
import { FakeContext } from '../testing/canvas';
import { DARK, LIGHT } from './palette';
import { drawBoxes, drawGridLabels, drawPicture, fieldPlacement } from './still';
import { newCanvas } from './surface';

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
