import { afterEach, beforeEach, describe, expect, test, vi, type Mock } from 'vitest';

import { isClear } from '../geometry/clear';
import { corners, type MapPoint, mapPoint, toCanvas, type Camera } from '../geometry/coordinates';
import { act, moveViewport, NO_VIEWPORT, onChange, store, type Viewport } from '../store/app';
import { MapCamera } from './camera';
import { started } from '../testing/life';

const size = { width: 600, height: 400 };
const bounds = { minX: 0, minY: 0, maxX: 4, maxY: 8 };
const content = { bounds, pins: corners(bounds) };
const viewport = (): Viewport => store.get().viewport;
let onView: Mock<() => void>;
let onCamera: Mock<(camera: Camera | null) => void>;
let stops: (() => void)[];
let camera: MapCamera;
let element: HTMLElement;

beforeEach(() => {
  act({ camera: null });
  moveViewport({ ...NO_VIEWPORT, size });
  onView = vi.fn<() => void>();
  onCamera = vi.fn<(camera: Camera | null) => void>();
  element = document.createElement('div');
  stops = [
    started((on) => {
      camera = new MapCamera(element, false, on);
    }),
    started((on) => onChange((state) => [state.viewport.view], onView, on)),
    started((on) =>
      onChange(
        ({ view }) => [view.camera],
        () => onCamera(store.get().view.camera),
        on,
      ),
    ),
  ];
});
afterEach(() => {
  for (const stop of stops) stop();
});

describe('camera', () => {
  test('shows everything, and does not take that for the operator’s choice', () => {
    camera.goTo(null, content);
    for (const corner of corners(bounds)) {
      const { x, y } = toCanvas(viewport().view, corner);
      expect(x >= 0 && x <= size.width && y >= 0 && y <= size.height).toBe(true);
    }
    expect(onView).toHaveBeenCalledTimes(1);
    expect(onCamera).not.toHaveBeenCalled();
  });

  test('going to what the operator chose changes nothing', () => {
    camera.goTo(null, content);
    for (let step = 0; step < 40; step++) {
      camera.zoomBy(step % 2 ? 1.37 : 0.81);
      camera.panBy(0.037, -0.113);
      const views = onView.mock.calls.length;
      const chosen = onCamera.mock.lastCall?.[0];
      camera.goTo(chosen ?? null, null);
      expect(onView).toHaveBeenCalledTimes(views);
    }
  });

  test('before its size is known it stays where it is', () => {
    moveViewport(NO_VIEWPORT);
    camera.goTo(null, content);
    expect(onView).not.toHaveBeenCalled();
  });

  test('zooming keeps the middle, and is a choice', () => {
    camera.goTo({ x: 2, y: 4, span: 8 }, null);
    const before = viewport().view.scale;
    camera.zoomBy(2);
    expect(viewport().view.scale).toBeCloseTo(before * 2);
    const middle = toCanvas(viewport().view, mapPoint(2, 4));
    expect(middle.x).toBeCloseTo(300);
    expect(middle.y).toBeCloseTo(200);
    expect(onCamera).toHaveBeenLastCalledWith(expect.objectContaining({ span: 4 }));
  });

  test('a double click zooms at once, about where it was', () => {
    camera.goTo({ x: 2, y: 4, span: 8 }, null);
    const before = viewport().view.scale;
    element.dispatchEvent(new MouseEvent('dblclick', { clientX: 300, clientY: 200 }));
    expect(viewport().view.scale).toBeCloseTo(before * 2);
    expect(toCanvas(viewport().view, mapPoint(2, 4)).x).toBeCloseTo(300);
  });

  test('panning right and down moves the map left and up', () => {
    camera.goTo({ x: 2, y: 4, span: 8 }, null);
    camera.panBy(0.1, 0.1);
    const middle = toCanvas(viewport().view, mapPoint(2, 4));
    expect(middle.x).toBeCloseTo(300 - 60);
    expect(middle.y).toBeCloseTo(200 - 40);
  });

  test('shows a point that is out of sight, in the middle', () => {
    camera.goTo({ x: 2, y: 4, span: 8 }, null);
    camera.show(mapPoint(2, 40));
    const shown = toCanvas(viewport().view, mapPoint(2, 40));
    expect(shown.x).toBeCloseTo(300);
    expect(shown.y).toBeCloseTo(200);
  });

  test('brings a pin near the edge into the middle once the operator has chosen a view', () => {
    act({ camera: { x: 2, y: 4, span: 8 } });
    camera.goTo({ x: 2, y: 4, span: 8 }, null);
    const { view } = viewport();
    const at = (x: number): MapPoint => mapPoint((x - view.x) / view.scale, 4);
    camera.show(at(41));
    expect(viewport().view).toBe(view);
    camera.show(at(39));
    expect(toCanvas(viewport().view, at(39)).x).toBeCloseTo(300);
  });

  test('a pin near the edge stays where it is while everything is shown', () => {
    camera.goTo(null, content);
    const { view } = viewport();
    for (const pin of content.pins) camera.show(pin);
    expect(viewport().view).toBe(view);
    expect(onCamera).not.toHaveBeenCalled();
  });

  test('a point below the buttons is not in sight', () => {
    camera.goTo({ x: 2, y: 4, span: 8 }, null);
    const { view } = viewport();
    const buttons = { left: 540, top: 40, right: 590, bottom: 240 };
    const hidden = mapPoint(2 + 250 / view.scale, 4);
    camera.show(hidden);
    expect(viewport().view).toEqual(view);
    camera.show(hidden, [buttons]);
    expect(toCanvas(viewport().view, hidden).x).toBeCloseTo(300);
  });

  test('a fit leaves no pin below the buttons', () => {
    const buttons = { left: 300, top: 0, right: 600, bottom: 120 };
    camera.goTo(null, content);
    const corner = mapPoint(bounds.maxX, bounds.maxY);
    expect(isClear(viewport().view, corner, [buttons])).toBe(false);
    camera.goTo(null, content, [buttons]);
    for (const pin of content.pins) expect(isClear(viewport().view, pin, [buttons])).toBe(true);
  });

  test('no hand and no link leads to where nothing of it is in sight', () => {
    camera.goTo(null, content);
    const isSeen = (): boolean => {
      const low = toCanvas(viewport().view, mapPoint(bounds.minX, bounds.minY));
      const high = toCanvas(viewport().view, mapPoint(bounds.maxX, bounds.maxY));
      return high.x >= 0 && low.x <= size.width && low.y >= 0 && high.y <= size.height;
    };
    for (const [x, y] of [
      [9, 0],
      [-9, 0],
      [0, 9],
      [0, -9],
    ] as const) {
      camera.panBy(x, y);
      expect(isSeen()).toBe(true);
    }
    camera.goTo({ x: 900_000, y: -900_000, span: 8 }, content);
    expect(isSeen()).toBe(true);
  });

  test('a hand zooms out to half of what shows all there is', () => {
    const wide = { ...bounds, minX: -1000, maxX: 1000 };
    for (const each of [bounds, wide]) {
      camera.goTo(null, { bounds: each, pins: corners(each) });
      const whole = viewport().view.scale;
      camera.zoomBy(1e-6);
      expect(viewport().view.scale).toBeCloseTo(whole / 2);
    }
  });

  const mouse = (target: EventTarget, type: string, x: number, buttons = 1): void => {
    target.dispatchEvent(new PointerEvent(type, { clientX: x, pointerId: 1, buttons }));
  };

  test('nothing that arrives takes the map out of the operator’s hand', () => {
    camera.goTo(null, content);
    const before = viewport().view;
    mouse(element, 'pointerdown', 100);
    mouse(element, 'pointermove', 140);
    camera.goTo(null, { ...content, bounds: { ...bounds, maxX: 40 } });
    expect(viewport().view).toEqual({ ...before, x: before.x + 40 });
    // Released over a context menu, or before the right button: no event says so.
    mouse(element, 'pointermove', 180, 0);
    mouse(element, 'pointermove', 220, 2);
    expect(viewport().view).toEqual({ ...before, x: before.x + 40 });
    expect(onCamera).toHaveBeenCalledTimes(1);
  });

  test('what the wheel chose holds for a hand that grabs the map at once', () => {
    vi.useFakeTimers();
    camera.goTo(null, content);
    const { scale } = viewport().view;
    element.dispatchEvent(new WheelEvent('wheel', { deltaY: -240 }));
    const zoomed = viewport().view;
    expect(zoomed.scale).toBeGreaterThan(scale);
    mouse(element, 'pointerdown', 100);
    // The wheel comes to rest during the drag, which goes on.
    vi.runAllTimers();
    expect(onCamera).not.toHaveBeenCalled();
    mouse(element, 'pointermove', 140);
    mouse(element, 'pointerup', 140);
    expect(onCamera).toHaveBeenCalledTimes(1);
    expect(viewport().view).toEqual({ ...zoomed, x: zoomed.x + 40 });
    vi.useRealTimers();
  });

  test('two fingers hold what is between them; the end of a drag is no click', () => {
    camera.goTo({ x: 2, y: 4, span: 8 }, content);
    const onClick = vi.fn();
    element.addEventListener('click', onClick);
    const finger = (type: string, pointerId: number, clientX: number): void => {
      element.dispatchEvent(
        new PointerEvent(type, { pointerId, clientX, clientY: 200, buttons: 1 }),
      );
    };
    const { scale } = viewport().view;
    finger('pointerdown', 1, 280);
    finger('pointerdown', 2, 320);
    finger('pointermove', 1, 300);
    finger('pointermove', 2, 380);
    expect(viewport().view.scale).toBeCloseTo(scale * 2);
    expect(toCanvas(viewport().view, mapPoint(2, 4)).x).toBeCloseTo(340);
    finger('pointerup', 1, 300);
    expect(onCamera).not.toHaveBeenCalled();
    finger('pointerup', 2, 380);
    expect(onCamera).toHaveBeenCalledOnce();
    element.dispatchEvent(new MouseEvent('click'));
    expect(onClick).not.toHaveBeenCalled();
    element.dispatchEvent(new MouseEvent('click'));
    expect(onClick).toHaveBeenCalledOnce();
  });

  test('another button, or Ctrl for a menu, moves nothing; a cancelled finger is let go', () => {
    camera.goTo({ x: 2, y: 4, span: 8 }, content);
    const { view } = viewport();
    for (const given of [{ button: 2 }, { ctrlKey: true }]) {
      element.dispatchEvent(new PointerEvent('pointerdown', { pointerId: 1, ...given }));
      mouse(element, 'pointermove', 40);
      expect(viewport().view).toBe(view);
    }
    const capture = vi.spyOn(element, 'setPointerCapture');
    mouse(element, 'pointerdown', 100);
    expect(capture).toHaveBeenCalledWith(1);
    mouse(element, 'pointercancel', 100);
    mouse(element, 'pointermove', 140);
    expect(viewport().view).toBe(view);
  });

  test.each([
    ['wheel', { deltaY: -100 }, 2 ** 0.2],
    ['wheel', { deltaY: -4, deltaMode: 1 }, 2 ** 0.2],
    ['wheel', { deltaY: -10, ctrlKey: true }, 2 ** 0.2],
    ['dblclick', {}, 2],
    ['dblclick', { shiftKey: true }, 0.5],
  ])('%s with %o zooms, and the page does not', (type, given, factor) => {
    camera.goTo({ x: 2, y: 4, span: 4 }, content);
    const { scale } = viewport().view;
    const Kind = type === 'wheel' ? WheelEvent : MouseEvent;
    const event = new Kind(type, { ...given, cancelable: true });
    element.dispatchEvent(event);
    expect(viewport().view.scale / scale).toBeCloseTo(factor);
    expect(event.defaultPrevented).toBe(true);
  });

  test('a click is no choice of a view', () => {
    camera.goTo(null, content);
    mouse(element, 'pointerdown', 100);
    mouse(element, 'pointermove', 100);
    mouse(element, 'pointerup', 100);
    expect(onCamera).not.toHaveBeenCalled();
    camera.goTo(null, { ...content, bounds: { ...bounds, maxX: 40 } });
    expect(onView).toHaveBeenCalledTimes(2);
  });

  test('a fixed one is moved by the program alone', () => {
    const wall = document.createElement('div');
    const fixed = new MapCamera(wall, true);
    fixed.goTo(null, content);
    const { view } = viewport();
    mouse(wall, 'pointerdown', 100);
    mouse(wall, 'pointermove', 140);
    mouse(wall, 'pointerup', 140);
    wall.dispatchEvent(new WheelEvent('wheel', { deltaY: -200 }));
    expect(viewport().view).toEqual(view);
    expect(onCamera).not.toHaveBeenCalled();
    fixed.goTo(null, { ...content, bounds: { ...bounds, maxX: 40 } });
    expect(viewport().view).not.toEqual(view);
  });

  test('a map that comes back into the page goes on where it was', () => {
    camera.goTo(null, content);
    const { view } = viewport();
    const again = new MapCamera(document.createElement('div'));
    expect(viewport().view).toBe(view);
    again.panBy(0.1, 0);
    expect(viewport().view.x).toBeCloseTo(view.x - 60);
    expect(viewport().view).toMatchObject({ y: view.y, scale: view.scale });
  });
});
