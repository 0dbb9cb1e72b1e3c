import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import { canvasPoint, mapPoint, toCanvas, type View } from '../geometry/coordinates';
import { act, receive, store } from '../store/app';
import { withField, withState } from '../store/twin';
import { withLayer } from '../store/view';
import { NOTHING } from '../store/fetcher';
import { started } from '../testing/life';
import { FakeContext } from '../testing/canvas';
import { showField, showTags } from '../testing/page';
import { readings, stateFrame, wireTag } from '../testing/tags';
import { pinUnderMouse, pointedAt } from './commands';
import { runMap } from './controller';

let element: HTMLElement;
let still: HTMLCanvasElement;
let pins: HTMLCanvasElement;
let overlay: HTMLCanvasElement;
let stop: () => void;
let frames: FrameRequestCallback[];

const fail = (error: unknown): void => {
  throw error;
};
const SIZE = { width: 600, height: 400 };
const tagAt = (id: string, x: number, y: number, sec = 100): ReturnType<typeof wireTag> =>
  wireTag({
    tag_id: id,
    pose: { position: { x, y, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } },
    last_observed: sec,
    readings: readings({ temperature: 20 }),
  });

const start = (isFixed = false): void => {
  const canvas = (): HTMLCanvasElement => document.createElement('canvas');
  overlay = canvas();
  pins = canvas();
  still = canvas();
  stop = started((on) => runMap(element, { still, pins, overlay }, isFixed, fail, on));
  paint();
};
/** Runs the callbacks of the next frame. */
const paint = (): void => {
  for (const frame of frames.splice(0)) frame(performance.now());
};
const view = (): View => store.get().viewport.view;
const drawn = (name: string): number => FakeContext.recordOf(overlay)?.named(name).length ?? 0;

const pointer = (type: string, x: number, y: number, pointerType = 'mouse'): void => {
  const at = { clientX: x, clientY: y };
  element.dispatchEvent(new PointerEvent(type, { ...at, pointerType, bubbles: true }));
};
const press = (key: string): void => {
  element.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true, cancelable: true }));
};

beforeEach(() => {
  frames = [];
  pointedAt.set(null);
  pinUnderMouse.set(null);
  vi.stubGlobal('requestAnimationFrame', (frame: FrameRequestCallback) => frames.push(frame));
  vi.stubGlobal('cancelAnimationFrame', () => {
    frames.splice(0);
  });
  vi.stubGlobal(
    'ResizeObserver',
    class {
      readonly #callback: ResizeObserverCallback;
      constructor(callback: ResizeObserverCallback) {
        this.#callback = callback;
      }
      observe(): void {
        this.#callback([{ contentRect: SIZE }] as never, this as never);
      }
      disconnect(): void {
        // Called only once.
      }
    },
  );
  element = document.createElement('div');
  document.body.append(element);
  showTags([tagAt('a', 1, 1), tagAt('b', 3, 2)]);
});
afterEach(() => {
  stop();
  element.remove();
});

const place = (x: number, y: number): readonly [number, number] => {
  const at = toCanvas(view(), mapPoint(x, y));
  return [at.x, at.y];
};

describe('on paper', () => {
  test('there is no mark of the mouse', () => {
    start();
    const strokesOf = (happen: () => void): number => {
      const before = drawn('stroke');
      happen();
      paint();
      return drawn('stroke') - before;
    };
    const marked = strokesOf(() => {
      pointer('pointermove', ...place(3, 2));
    });
    expect(marked).toBeGreaterThan(0);
    expect(strokesOf(() => window.dispatchEvent(new Event('beforeprint')))).toBe(0);
    expect(strokesOf(() => window.dispatchEvent(new Event('afterprint')))).toBe(marked);
  });
});

describe('mouse and finger', () => {
  test('the mouse on a pin marks the tag and its place, until it leaves', () => {
    start();
    const [x, y] = place(3, 2);
    pointer('pointermove', x + 3, y - 2);
    expect(store.get().view.hovered).toBe('b');
    const shown = pinUnderMouse.get();
    expect(shown).toMatchObject({ tagId: 'b', at: canvasPoint(x, y) });
    // Moving within a pin redraws nothing.
    pointer('pointermove', x + 4, y - 2);
    expect(pinUnderMouse.get()).toBe(shown);
    pointer('pointerleave', 0, 0);
    expect(store.get().view.hovered).toBeNull();
    expect(pinUnderMouse.get()).toBeNull();
  });

  test('a map that moves takes its pins away from under the mouse', () => {
    start();
    pointer('pointermove', ...place(3, 2));
    press('ArrowLeft');
    expect(pinUnderMouse.get()).toBeNull();
  });

  test('a finger points at nothing while it moves', () => {
    start();
    pointer('pointermove', ...place(3, 2), 'touch');
    expect(store.get().view.hovered).toBeNull();
    expect(pinUnderMouse.get()).toBeNull();
  });

  test('a finger reaches farther than a mouse', () => {
    start();
    const [x, y] = place(3, 2);
    pointer('click', x + 22, y);
    expect(store.get().view.selected).toBeNull();
    pointer('click', x + 22, y, 'touch');
    expect(store.get().view.selected).toBe('b');
    pointer('click', x + 40, y, 'touch');
    expect(store.get().view.selected).toBeNull();
  });

  test('pins that are switched off are not hit', () => {
    start();
    act(withLayer('pins', false));
    pointer('click', ...place(3, 2));
    expect(store.get().view.selected).toBeNull();
  });
});

test('the read-out follows the mouse', () => {
  start();
  pointer('pointermove', ...place(2, 1.5));
  expect(pointedAt.get()?.x).toBeCloseTo(2);
  expect(pointedAt.get()?.y).toBeCloseTo(1.5);
});

test('a wall screen is for looking: nothing chooses a tag or moves the map', () => {
  start(true);
  const before = view();
  const { view: chosen } = store.get();
  pointer('click', ...place(3, 2));
  pointer('click', ...place(3, 2), 'touch');
  for (const key of ['Enter', 'ArrowLeft', '+']) press(key);
  element.dispatchEvent(new WheelEvent('wheel', { deltaY: -240, bubbles: true }));
  expect(view()).toEqual(before);
  expect(store.get().view).toBe(chosen);
  // Where the mouse is may be told; it is forgotten with the mouse.
  pointer('pointermove', ...place(3, 2));
  expect(pinUnderMouse.get()?.tagId).toBe('b');
  expect(element.dataset['hand']).toBe('grab');
});

describe('keyboard', () => {
  const crosshair = (): boolean => pointedAt.get() !== null;

  test('a key that is not the map’s own leaves the read-out to the mouse', () => {
    start();
    press('2');
    press('Shift');
    expect(crosshair()).toBe(false);
  });

  test.each(['ArrowUp', '+', 'Enter', '0'])('%s is: the crosshair comes', (key) => {
    start();
    press(key);
    expect(crosshair()).toBe(true);
    element.dispatchEvent(new FocusEvent('blur'));
    expect(crosshair()).toBe(false);
  });

  test('Enter chooses the tag nearest to the crosshair', () => {
    start();
    act({ camera: { x: 3, y: 2, span: 8 } });
    press('Enter');
    expect(store.get().view.selected).toBe('b');
  });
});

test('everything is in sight, the heat map too', () => {
  const field = {
    sensor: 'temperature',
    width: 60,
    height: 50,
    originX: -2,
    originY: -4,
    resolution: 0.1,
    valueMin: 1,
    valueMax: 2,
    sampleCount: 2,
    values: new Float32Array(3_000).fill(1),
  };
  start();
  showField(field);
  for (const [x, y] of [place(-2, -4), place(4, 1)]) {
    expect(x >= 0 && x <= SIZE.width && y >= 0 && y <= SIZE.height).toBe(true);
  }
  // Another sensor's heat map, on the same grid, is being fetched.
  const before = view();
  receive(withField(NOTHING));
  const tags = [tagAt('a', 1, 1, 200), tagAt('b', 3, 2)];
  receive(withState(stateFrame(tags, { sec: 5_000, revision: 'later' }), performance.now()));
  paint();
  expect(view()).toEqual(before);
});

test('a map of another size is drawn at once, and not empty for a frame', () => {
  const still = document.createElement('canvas');
  stop = started((on) => runMap(element, { still, pins, overlay }, false, fail, on));
  expect(FakeContext.recordOf(still)?.named('clearRect').length).toBeGreaterThan(0);
});

test('a font that comes late is drawn with', () => {
  start();
  const labels = FakeContext.recordOf(pins);
  const before = labels?.calls.length;
  const made = vi.spyOn(document, 'createElement');
  document.fonts.dispatchEvent(new Event('loadingdone'));
  paint();
  expect(labels?.calls.length).toBeGreaterThan(before ?? NaN);
  // The labels' sprites are repainted, not copied.
  expect(made).toHaveBeenCalledWith('canvas');
});

describe('nothing is drawn anew but what changed', () => {
  const strokes = (canvas: HTMLCanvasElement): number =>
    FakeContext.recordOf(canvas)?.calls.length ?? 0;
  const all = (): number[] => [still, pins, overlay].map(strokes);

  test('a mouse that moves over pins leaves all below the mark alone', () => {
    start();
    const [stillBefore, pinsBefore, overlayBefore = 0] = all();
    pointer('pointermove', ...place(1, 1));
    paint();
    expect(store.get().view.hovered).toBe('a');
    pointer('pointermove', ...place(3, 2));
    paint();
    expect(store.get().view.hovered).toBe('b');
    const [stillAfter, pinsAfter, overlayAfter] = all();
    expect([stillAfter, pinsAfter]).toEqual([stillBefore, pinsBefore]);
    expect(overlayAfter).toBeGreaterThan(overlayBefore);
  });

  test('a heartbeat that changes nothing draws no frame', () => {
    start();
    const { snapshot } = store.get().twin.latest;
    const tags = (snapshot?.tags ?? []).map(({ wire }) => structuredClone(wire));
    const later = { sec: (snapshot?.at ?? 0) + 1, revision: snapshot?.revision ?? '' };
    receive(withState(stateFrame(tags, later), performance.now() + 1_000));
    expect(store.get().twin.latest.snapshot).not.toBe(snapshot);
    expect(frames).toEqual([]);
  });
});
