import { describe, expect, test } from 'vitest';

import { mapPoint } from '../geometry/coordinates';
import { FakeContext } from '../testing/canvas';
import { LIGHT } from './palette';
import { bloomRadius, drawBlooms, drawLabels, drawPins, labelRequests, pinRadius } from './pins';
import type { Pin } from './scene';
import { Sprites, type Surface } from './surface';

const view = { x: 0, y: 400, scale: 100 };

const pin = (over: Partial<Pin> = {}): Pin => ({
  id: '1',
  at: mapPoint(1, 1),
  kind: 'value',
  share: 0.5,
  strength: 1,
  pest: false,
  texts: ['1 · 20', '1'],
  priority: 0,
  ...over,
});

/** Draws and returns what was copied to the surface, and what was painted into each sprite. */
function draw(pins: readonly Pin[]): { copies: FakeContext; sprites: FakeContext[] } {
  const copies = new FakeContext();
  const sprites: FakeContext[] = [];
  const surface: Surface = {
    context: copies.asContext(),
    size: { width: 400, height: 400 },
    ratio: 1,
  };
  class Spy extends Sprites {
    override get(...args: Parameters<Sprites['get']>): HTMLCanvasElement {
      const [key, width, height, paint] = args;
      return super.get(key, width, height, (context) => {
        const spy = new FakeContext(context.canvas);
        sprites.push(spy);
        paint(spy.asContext());
      });
    }
  }
  drawPins(surface, view, pins, [255, 0, 0], new Spy(1), LIGHT);
  return { copies, sprites };
}

describe('pins', () => {
  test('one of the same look is painted once and copied twice', () => {
    const { copies, sprites } = draw([pin(), pin({ at: mapPoint(2, 2) })]);
    expect(sprites).toHaveLength(1);
    expect(copies.named('drawImage')).toHaveLength(2);
  });

  test('is copied with its centre on its place', () => {
    const [copy] = draw([pin()]).copies.named('drawImage');
    const [, x, y] = copy?.args as [unknown, number, number];
    const half = pinRadius(100) + 3;
    expect([x + half, y + half]).toEqual([100, 300]);
  });

  test('fades with age, and a pest’s ring does not', () => {
    const { copies } = draw([pin({ strength: 0.5, pest: true })]);
    const alphas = copies.named('drawImage').map(({ state }) => state['globalAlpha']);
    expect(alphas).toEqual([0.5, 1]);
  });

  test('a value is filled; a lacking sensor is hollow and dashed', () => {
    const [filled] = draw([pin()]).sprites;
    expect(filled?.named('fill')).toHaveLength(1);
    expect(filled?.named('setLineDash')).toHaveLength(0);
    const [hollow] = draw([pin({ kind: 'lacking' })]).sprites;
    expect(hollow?.named('fill')).toHaveLength(0);
    expect(hollow?.named('setLineDash')).toHaveLength(1);
  });

  test('a failed sensor is hollow, and struck through instead of dashed', () => {
    const [failed] = draw([pin({ kind: 'failed' })]).sprites;
    expect(failed?.named('fill')).toHaveLength(0);
    expect(failed?.named('setLineDash')).toHaveLength(0);
    expect(failed?.named('stroke')).toHaveLength(2);
  });

  test('the pest’s ring is dashed and carries a sign', () => {
    const [, ring] = draw([pin({ pest: true })]).sprites;
    expect(ring?.named('setLineDash')[0]?.args).not.toEqual([[]]);
    expect(ring?.named('arc')).toHaveLength(1);
    expect(ring?.named('fillRect').length).toBeGreaterThan(0);
  });

  test('what is out of sight is not copied', () => {
    expect(draw([pin({ at: mapPoint(50, 1) })]).copies.named('drawImage')).toHaveLength(0);
  });
});

test('blooms share a sprite a colour', () => {
  const copies = new FakeContext();
  const surface = { context: copies.asContext(), size: { width: 400, height: 400 }, ratio: 1 };
  const dot = (x: number, red: number): Parameters<typeof drawBlooms>[2][number] => ({
    at: mapPoint(x, 1),
    look: { colour: [red, 0, 0], shape: 'circle' },
  });
  drawBlooms(surface, view, [dot(1, 1), dot(2, 1), dot(3, 2)], new Sprites(1), LIGHT);
  const canvases = copies.named('drawImage').map(({ args }) => args[0]);
  expect(canvases).toHaveLength(3);
  expect(new Set(canvases).size).toBe(2);
});

test('the chosen pin’s label comes before all others', () => {
  const pins = [pin({ priority: 9 }), pin({ id: '2' })];
  const [a, b] = labelRequests(pins, 100, '2', (text) => text.length);
  expect(b?.priority).toBeGreaterThan(a?.priority ?? NaN);
});

test('labels are copied relative to the map’s origin', () => {
  const copies = new FakeContext();
  const surface = { context: copies.asContext(), size: { width: 400, height: 400 }, ratio: 1 };
  const label = { id: '1', text: '1', x: 50, y: -100, width: 20 };
  drawLabels(surface, view, [label], new Sprites(1), LIGHT);
  expect(copies.named('drawImage')[0]?.args.slice(1, 3)).toEqual([50, 300]);
});

test('labels are as high as their text asks for', () => {
  const copies = new FakeContext();
  const surface = { context: copies.asContext(), size: { width: 400, height: 400 }, ratio: 1 };
  const label = { id: '1', text: '1', x: 50, y: -100, width: 20 };
  drawLabels(surface, view, [label], new Sprites(1), LIGHT, 2);
  expect(copies.named('drawImage')[0]?.args[4]).toBe(36);
});

test('pins and blooms shrink with the map, within limits', () => {
  expect(pinRadius(1)).toBe(5);
  expect(pinRadius(5000)).toBe(11);
  expect(bloomRadius(1)).toBe(1.5);
  expect(bloomRadius(5000)).toBe(6);
});
