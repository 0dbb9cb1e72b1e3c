import { beforeEach, describe, expect, test } from 'vitest';

import type { Box } from '../geometry/coordinates';
import { act, prefer, receive, store } from '../store/app';
import { withField } from '../store/twin';
import { type Layer, withTag } from '../store/view';
import { FakeContext } from '../testing/canvas';
import { fieldWith } from '../testing/field';
import { judgement, reason } from '../testing/health';
import { showField, showTags } from '../testing/page';
import { FILE } from '../testing/sensors';
import { readings, wireTag } from '../testing/tags';
import { Painter, type Canvases } from './painter';

const view = { x: 50, y: 350, scale: 40 };
let canvases: Canvases;
let painter: Painter;

const calls = (canvas: HTMLCanvasElement): FakeContext['calls'] =>
  FakeContext.recordOf(canvas)?.calls ?? [];
const named = (canvas: HTMLCanvasElement, name: string): FakeContext['calls'] =>
  calls(canvas).filter((call) => call.name === name);

beforeEach(() => {
  canvases = {
    still: document.createElement('canvas'),
    pins: document.createElement('canvas'),
    overlay: document.createElement('canvas'),
  };
  painter = new Painter(canvases);
  painter.resize({ width: 300, height: 400 }, 2);
  showTags([
    wireTag({ tag_id: '1', readings: readings({ temperature: 20 }) }),
    wireTag({
      tag_id: '2',
      pose: { position: { x: 0, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 0 } },
    }),
  ]);
  showField(
    fieldWith([
      [1, 2],
      [NaN, 2],
    ]),
  );
});

const show = (...layers: Layer[]): void => {
  act({ layers: new Set(layers) });
};

describe('painter', () => {
  test('the canvases have the screen’s pixels', () => {
    expect([canvases.still.width, canvases.still.height]).toEqual([600, 800]);
  });

  test('the field is on the still canvas, the pins are on theirs', () => {
    show('field', 'pins');
    painter.paintStill(store.get(), view, 0, true);
    expect(named(canvases.still, 'drawImage')).toHaveLength(1);
    expect(calls(canvases.pins)).toHaveLength(0);
    painter.paintPins(store.get(), view, 0, true, []);
    expect(named(canvases.pins, 'drawImage')).toHaveLength(1);
    expect(named(canvases.still, 'drawImage')).toHaveLength(1);
  });

  test('the field is coloured once, not with each frame', () => {
    show('field');
    painter.paintStill(store.get(), view, 0, true);
    painter.paintStill(store.get(), { ...view, scale: 50 }, 16, false);
    const [first, second] = named(canvases.still, 'drawImage').map(({ args }) => args[0]);
    expect(first).toBe(second);
  });

  test('what is not known is hatched below the field, and outlined above it', () => {
    show('field', 'unknown');
    painter.paintStill(store.get(), view, 0, true);
    const [hatching, field] = named(canvases.still, 'drawImage').map(({ args }) => args[0]);
    expect(hatching).toMatchObject({ width: 600, height: 800 });
    expect(field).toMatchObject({ width: 6, height: 6 });
    expect(calls(canvases.still).at(-1)?.name).toBe('stroke');
  });

  test.each(['ideal', 'value'] as const)(
    'what is too old to say is faint and hatched, by %s',
    (colouring) => {
      const said = (kind: 'old' | 'range'): ReturnType<typeof judgement> =>
        judgement({ '1': [reason({ kind, verdict: 'unknown', sensor: '' })] });
      const paint = (kind: 'old' | 'range'): { pictures: number; alpha: number | undefined } => {
        const field = store.get().twin.latest.field;
        showTags([wireTag({ tag_id: '1', readings: readings({ temperature: 20 }) })], said(kind));
        receive(withField(field));
        act({ colouring });
        show('field', 'unknown');
        calls(canvases.still).length = 0;
        painter.paintStill(store.get(), view, 0, true);
        const pictures = named(canvases.still, 'drawImage');
        const [, coloured] = pictures.map(({ args }) => args[0] as HTMLCanvasElement);
        const [put] = coloured ? named(coloured, 'putImageData') : [];
        return { pictures: pictures.length, alpha: (put?.args[0] as ImageData).data[43] };
      };
      const known = paint('range');
      const old = paint('old');
      // The unknown part, the field, and now the hatching over it.
      expect([known.pictures, old.pictures]).toEqual([2, 3]);
      expect(old.alpha).toBeGreaterThan(0);
      expect(old.alpha).toBeLessThan((known.alpha ?? 0) / 2);
    },
  );

  test('layers that are off are not drawn', () => {
    show();
    painter.paintStill(store.get(), view, 0, true);
    painter.paintPins(store.get(), view, 0, true, []);
    expect(named(canvases.still, 'drawImage')).toHaveLength(0);
    expect(named(canvases.pins, 'drawImage')).toHaveLength(0);
  });

  test('blooms are a layer of their own', () => {
    const bloom = { height_m: 0, species: 'rose', confidence: 1, anomaly: false };
    showTags([wireTag({ flowers: [{ ...bloom, position: { x: 1, y: 2, z: 0 } }] })]);
    show('blooms');
    painter.paintPins(store.get(), view, 0, true, []);
    expect(named(canvases.pins, 'drawImage')).toHaveLength(1);
  });

  test('a label gives way to the robot and other marks', () => {
    show('pins', 'labels');
    // Where tag 1's label begins, pixels: its sprite is the last that is drawn.
    const labelAt = (...marks: Box[]): number[] => {
      painter.paintPins(store.get(), view, 0, true, [], marks);
      return named(canvases.pins, 'drawImage').at(-1)?.args.slice(1, 3) as number[];
    };
    const [x = NaN, y = NaN] = labelAt();
    const [left, top] = [x - view.x, y - view.y];
    // It lies over half of the pin too.
    const [away = NaN] = labelAt({ left: left - 12, top, right: left + 30, bottom: top + 40 });
    expect(away).toBeLessThan(x);
  });

  test('the chosen and the hovered tag are marked', () => {
    act(withTag('1'));
    painter.paintOverlay(store.get(), view, false);
    expect(named(canvases.overlay, 'stroke').length).toBeGreaterThan(0);
  });

  test('text on the map grows with that of the page', () => {
    show('grid');
    painter.resize({ width: 300, height: 400 }, 2, 2);
    painter.paintStill(store.get(), view, 0, true);
    expect(named(canvases.still, 'fillText')[0]?.state['font']).toContain('500 21px');
  });

  test('the theme changes what is drawn', () => {
    show();
    document.body.append(canvases.still);
    for (const ground of ['white', 'black']) {
      canvases.still.style.setProperty('--sunken', ground);
      painter.recolour();
      painter.paintStill(store.get(), view, 0, true);
    }
    const grounds = named(canvases.still, 'fillRect').map(({ state }) => state['fillStyle']);
    expect(new Set(grounds).size).toBe(2);
  });

  test('areas are drawn where the table is grouped by them', () => {
    const value = { ...FILE, areas: { 'Bay 1': ['1'], 'Bay 2': ['2'] } };
    receive({ sensors: { value, state: 'ready', message: '' } });
    show();
    painter.paintStill(store.get(), view, 0, true);
    expect(named(canvases.still, 'strokeRect')).toHaveLength(0);
    prefer({ byArea: true });
    painter.paintStill(store.get(), view, 0, true);
    // Tag 2 has no place.
    expect(named(canvases.still, 'fillText').map(({ args }) => args[0])).toEqual(['Bay 1']);
    expect(named(canvases.still, 'strokeRect')).toHaveLength(1);
  });

  test('what looks the same is the very same scene, and what has faded is not', () => {
    const now = performance.now();
    const first = painter.scene(store.get(), now);
    act({ sensor: 'humidity' });
    expect(painter.scene(store.get(), now)).not.toBe(first);
    act({ sensor: 'temperature' });
    const again = painter.scene(store.get(), now);
    expect(painter.scene(store.get(), now + 5_000)).toBe(again);
    expect(painter.scene(store.get(), now + 1_800_000)).not.toBe(again);
  });
});
