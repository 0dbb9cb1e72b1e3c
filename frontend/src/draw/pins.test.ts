import { describe, expect, test } from 'vitest';

import type { Verdict } from '../contract/types';
import { VERDICTS } from '../domain/health';
import { mapPoint } from '../geometry/coordinates';
import { FakeContext } from '../testing/canvas';
import { penOn } from '../testing/pen';
import {
  bloomRadius,
  drawBlooms,
  drawCrosshair,
  drawLabels,
  drawMark,
  drawPins,
  labelRequests,
  pinRadius,
} from './pins';
import type { Pin } from './scene';
import { type Pen, Sprites } from './surface';

const view = { x: 0, y: 400, scale: 100 };

const pin = (over: Partial<Pin> = {}): Pin => ({
  id: '1',
  at: mapPoint(1, 1),
  kind: 'value',
  verdict: 'healthy',
  strength: 1,
  pest: false,
  texts: ['1 · 20', '1'],
  priority: 0,
  ...over,
});

/** Draws and returns what was copied to the surface, and what was painted into each sprite. */
function draw(
  pins: readonly Pin[],
  spacing = Infinity,
): { copies: FakeContext; sprites: FakeContext[] } {
  const copies = new FakeContext();
  const sprites: FakeContext[] = [];
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
  drawPins(penOn(copies, { view, sprites: new Spy(1) }), pins, spacing);
  return { copies, sprites };
}

describe('pins', () => {
  test('one of the same look is painted once and copied twice', () => {
    const { copies, sprites } = draw([pin(), pin({ id: '2', at: mapPoint(2, 2) })]);
    expect(sprites).toHaveLength(1);
    expect(copies.named('drawImage')).toHaveLength(2);
  });

  test('is copied with its centre on its place', () => {
    const [copy] = draw([pin()]).copies.named('drawImage');
    const [, x, y] = copy?.args as [unknown, number, number];
    const half = pinRadius(100) + 5;
    expect([x + half, y + half]).toEqual([100, 300]);
  });

  test('fades with age, and a pest’s ring does not', () => {
    const { copies } = draw([pin({ strength: 0.5, pest: true })]);
    const alphas = copies.named('drawImage').map(({ state }) => state['globalAlpha']);
    expect(alphas).toEqual([0.5, 1]);
  });

  const fills = (over: Partial<Pin>): unknown[] =>
    draw([pin(over)])
      .sprites[0]?.named('fill')
      .map(({ state }) => state['fillStyle']) ?? [];
  const strokes = (over: Partial<Pin>): FakeContext['calls'] =>
    draw([pin(over)]).sprites[0]?.named('stroke') ?? [];

  test.each(VERDICTS)('one that is %s has the body of its verdict', (verdict) => {
    expect(fills({ verdict })).toEqual([`pin-${verdict}`]);
  });

  test('without a reading of the sensor in view a body is empty, its line in the verdict’s colour', () => {
    const empty = ['pin-unknown'];
    const red = 'critical';
    for (const kind of ['lacking', 'failed'] as const) {
      expect(fills({ verdict: 'critical', kind })).toEqual(empty);
      expect(strokes({ verdict: 'critical', kind })[1]?.state['strokeStyle']).toBe(red);
    }
    const dashes = (kind: Pin['kind']): unknown[] =>
      draw([pin({ kind })]).sprites[0]?.named('setLineDash') ?? [];
    expect(dashes('lacking')).toHaveLength(2);
    expect(dashes('failed')).toHaveLength(1);
    // Halo, outline, and a stroke through it instead of the sign.
    const sign = (kind: Pin['kind']): unknown => strokes({ kind })[2]?.args[0];
    expect(sign('failed')).not.toEqual(sign('value'));
    expect(sign('lacking')).toEqual(sign('value'));
  });

  test('a healthy one without the sensor in view is smaller; a warning never is', () => {
    const size = (over: Partial<Pin>): unknown =>
      draw([pin({ kind: 'lacking', ...over })]).sprites[0]?.named('scale')[0]?.args[0];
    expect([size({}), size({ kind: 'value' })]).toEqual([9, 11]);
    expect(size({ verdict: 'critical' })).toBe(12);
  });

  test('who needs somebody lies on top, whatever the order', () => {
    const order = (...verdicts: Verdict[]): unknown[] =>
      draw(verdicts.map((verdict, id) => pin({ id: String(id), verdict, strength: 1 - id / 10 })))
        .copies.named('drawImage')
        .map(({ state }) => state['globalAlpha']);
    expect(order('critical', 'healthy', 'unknown', 'stressed')).toEqual([0.9, 0.8, 0.7, 1]);
  });

  test('where pins crowd only a critical one has room for its sign; closer still, healthy ones go', () => {
    // Halo, outline and cross.
    const lines = (spacing: number) =>
      VERDICTS.map(
        (verdict) => draw([pin({ verdict })], spacing).sprites[0]?.named('stroke').length,
      );
    expect(lines(0.09)).toEqual([3, 2, 2, 2]);
    expect(lines(0.05)).toEqual([3, 2, 2, undefined]);
  });

  test('the pest’s ring is dashed and carries a bug', () => {
    const [, ring] = draw([pin({ pest: true })]).sprites;
    expect(ring?.named('setLineDash')[0]?.args).not.toEqual([[]]);
    expect(ring?.named('ellipse')).toHaveLength(1);
  });

  test('what is out of sight is not copied', () => {
    expect(draw([pin({ at: mapPoint(50, 1) })]).copies.named('drawImage')).toHaveLength(0);
  });
});

test('blooms share a sprite a colour, each in its place; what is out of sight is left out', () => {
  const copies = new FakeContext();
  const dot = (x: number, red: number): Parameters<typeof drawBlooms>[1][number] => ({
    at: mapPoint(x, 1),
    look: { colour: [red, 0, 0], shape: 'circle' },
  });
  drawBlooms(penOn(copies), [dot(1, 1), dot(2, 1), dot(3, 2), dot(50, 1)]);
  const drawn = copies.named('drawImage').map(({ args }) => args);
  // In the middle of a sprite; 40 pixels are a metre.
  const middles = drawn.map(([, x, y, size]) => [x, y].map((it) => Number(it) + Number(size) / 2));
  expect(middles.map((at) => at.map(Math.round))).toEqual([90, 130, 170].map((x) => [x, 210]));
  const sprites = [...new Set(drawn.map(([sprite]) => sprite as HTMLCanvasElement))];
  const fills = sprites.map((it) => FakeContext.recordOf(it)?.named('fill')[0]?.state['fillStyle']);
  expect(fills).toEqual(['rgb(1 0 0)', 'rgb(2 0 0)']);
  // Zoomed out, they would hide the heat map.
  const far = new FakeContext();
  drawBlooms(penOn(far, { view: { ...view, scale: 10 } }), [dot(1, 1)]);
  expect(far.named('drawImage')).toHaveLength(0);
});

test('the chosen pin’s label comes before all others', () => {
  const pins = [pin({ priority: 9 }), pin({ id: '2' })];
  const [a, b] = labelRequests({ pins, spacing: Infinity }, 100, '2', (text) => text.length);
  expect(b?.priority).toBeGreaterThan(a?.priority ?? NaN);
});

test('among crowded pins only the worst and the chosen are named, or few that a filter lists', () => {
  const named = (pins: readonly Pin[], scale: number): string[] =>
    labelRequests({ pins, spacing: 1 }, scale, '7', () => 20).map(({ id }) => id);
  const pins = Array.from({ length: 99 }, (_, index) =>
    pin({ id: `${index}`, verdict: index === 3 ? 'critical' : 'stressed', pest: index === 5 }),
  );
  expect(named(pins, 10)).toEqual(['3', '5', '7']);
  expect(named(pins, 80)).toHaveLength(99);
  const few = pins.map((each, index) => (index < 9 ? each : { ...each, texts: [] }));
  expect(named(few, 10)).toHaveLength(99);
});

test('labels are copied relative to the map’s origin', () => {
  const copies = new FakeContext();
  const label = { id: '1', text: '1', x: 50, y: -100, width: 20 };
  drawLabels(penOn(copies, { view }), [label]);
  expect(copies.named('drawImage')[0]?.args.slice(1, 3)).toEqual([50, 300]);
  // As high as their text needs.
  drawLabels(penOn(copies, { textScale: 2 }), [label]);
  expect(copies.named('drawImage')[1]?.args[4]).toBe(36);
});

test('pins and blooms shrink with the map, within limits', () => {
  expect(pinRadius(1)).toBe(5);
  expect(pinRadius(5000)).toBe(11);
  // If they are crowded, the heat map shows between them.
  expect(pinRadius(5, 2)).toBe(2);
  expect(pinRadius(20, 2)).toBe(5);
  expect(bloomRadius(1)).toBe(1.5);
  expect(bloomRadius(5000)).toBe(6);
});

describe('overlay', () => {
  const view = { x: 0, y: 100, scale: 50 };
  const set = (): { context: FakeContext; pen: Pen } => {
    const context = new FakeContext();
    return { context, pen: penOn(context, { view, size: { width: 101, height: 61 } }) };
  };

  const path = (context: FakeContext): string =>
    (context.named('stroke')[0]?.args[0] as { d: string } | undefined)?.d ?? '';

  test('the mark surrounds its pin', () => {
    const { context, pen } = set();
    drawMark(pen, mapPoint(1, 1), true);
    const [, left, y, radius] = /^M(\S+) (\S+)a(\S+) /.exec(path(context)) ?? [];
    expect([Number(left) + Number(radius), Number(y)]).toEqual([50, 50]);
    // With the pest ring inside.
    expect(Number(radius)).toBeGreaterThan(pinRadius(50) + 7);
  });

  test('the crosshair is in the middle', () => {
    const { context, pen } = set();
    drawCrosshair(pen);
    expect(path(context)).toMatch(/^M39\.5 31\.5h/);
  });
});
