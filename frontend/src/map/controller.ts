/** Connects the map's canvases to the store: redraws only what changed, once per frame. */
import { now } from '../clock';
import { pinRadius } from '../draw/pins';
import type { Pin } from '../draw/scene';
import {
  type Box,
  canvasPoint,
  nearest,
  toCanvas,
  toMap,
  type CanvasPoint,
  type MapPoint,
  type View,
} from '../geometry/coordinates';
import { act, moveViewport, store, type AppState } from '../store/app';
import { marksOnMap } from '../store/create';
import { withTag } from '../store/view';
import {
  selectAreaOf,
  selectHeat,
  selectListed,
  selectRange,
  selectSensor,
} from '../store/derived';
import { selectHasTime, selectLatest, selectShown, selectTag } from '../store/moment';
import { isPrinting, onThemeChange } from '../store/theme';
import { type Content, contentOf, coveredBoxes, MapCamera, together, watchCovered } from './camera';
import { keyAction, type MapActions, pinUnderMouse, pointedAt, theMap } from './commands';
import { Painter, type Canvases } from './painter';

/** A finger hits a pin within this distance, a mouse within a bit less; CSS pixels. */
const TOUCH_REACH = 26;
const MOUSE_REACH = 16;
/** Usual size of the page's text, px (`font` of the body in `styles/base.css`). */
const TEXT_PX = 14;

/** What to redraw; "view": only position and scale changed. */
type Part = 'still' | 'pins' | 'overlay' | 'view';

/**
 * `isFixed`: a wall screen, where an accidental touch must not choose a tag or move the map.
 * `onFailure` receives an error while drawing: the map is then out of date.
 */
export function runMap(
  element: HTMLElement,
  canvases: Canvases,
  isFixed: boolean,
  onFailure: (error: unknown) => void,
  signal: AbortSignal,
): void {
  const guarded = (work: () => void) => (): void => {
    try {
      work();
    } catch (error) {
      onFailure(error);
    }
  };
  const painter = new Painter(canvases);
  const dirty = new Set<Part>();
  let frame = 0;
  let crosshair = false;
  /** The parts of the map below other elements. */
  let covered: readonly Box[] = [];
  let drawn = store.get();
  let lastField = selectShown(drawn).field.value;

  const camera = new MapCamera(element, isFixed, signal);

  const publish = ({ x, y, scale }: View): void => {
    canvases.overlay.dataset['view'] = [x, y, scale].map((n) => n.toFixed(4)).join(',');
    if (crosshair) pointedAt.set(centre());
  };

  // A map that returns to the page may not move, and then would not publish.
  publish(store.get().viewport.view);

  const spoil = (...parts: Part[]): void => {
    for (const part of parts) dirty.add(part);
    if (frame === 0 && store.get().viewport.size.width > 0) frame = requestAnimationFrame(paint);
  };

  const paint = guarded(() => {
    // It may be called before its scheduled frame.
    cancelAnimationFrame(frame);
    frame = 0;
    const live = store.get();
    const onPaper = isPrinting();
    const state = onPaper ? { ...live, view: { ...live.view, hovered: null } } : live;
    const { view } = live.viewport;
    const at = now();
    const parts = new Set(dirty);
    dirty.clear();
    if (parts.has('still') || parts.has('view')) {
      painter.paintStill(state, view, at, parts.has('still'));
    }
    if (parts.has('pins') || parts.has('view')) {
      const boxes = camera.isHeld ? null : covered;
      painter.paintPins(state, view, at, parts.has('pins'), boxes, marksOnMap.get());
    }
    if (parts.has('overlay') || parts.has('view')) {
      painter.paintOverlay(state, view, crosshair && !onPaper);
    }
  });

  const middle = (): CanvasPoint => {
    const { width, height } = store.get().viewport.size;
    return canvasPoint(width / 2, height / 2);
  };
  const centre = (): MapPoint => toMap(store.get().viewport.view, middle());

  const update = (): void => {
    const before = drawn;
    const state = store.get();
    drawn = state;
    const { view } = state;
    const house = selectShown(state);
    const last = selectShown(before);
    lastField = house.field.value ?? lastField;
    const changedTags = house.snapshot?.tags !== last.snapshot?.tags;
    const sameMap = house.map === last.map;
    const stillChanged =
      !sameMap ||
      house.field !== last.field ||
      view.layers !== before.view.layers ||
      selectSensor(state) !== selectSensor(before) ||
      selectRange(state) !== selectRange(before) ||
      selectHeat(state) !== selectHeat(before) ||
      selectAreaOf(state) !== selectAreaOf(before) ||
      (changedTags && house.snapshot?.revision !== last.snapshot?.revision);
    if (state.viewport.view !== before.viewport.view) {
      publish(state.viewport.view);
      // The pin has moved away from the mouse.
      pinUnderMouse.set(null);
      spoil('view');
    }
    if (stillChanged) spoil('still');
    if (
      changedTags ||
      stillChanged ||
      house.health !== last.health ||
      selectHasTime(state) !== selectHasTime(before) ||
      state.settings !== before.settings ||
      selectListed(state) !== selectListed(before)
    )
      spoil('pins', 'overlay');
    // Only the mark follows the mouse; the layers below stay.
    if (view.hovered !== before.view.hovered) spoil('overlay');
    if (view.selected !== before.view.selected) spoil('pins', 'overlay');
    // Labels are placed again.
    if (view.camera !== before.view.camera) spoil('pins');
    const { selected } = view;
    if (selected !== null && selected !== before.view.selected) {
      // After the card is laid out, which covers part of the map on a phone.
      requestAnimationFrame(() => show(selected));
    }
    const sameContent = !changedTags && sameMap && house.field === last.field;
    if (view.camera !== before.view.camera || !sameContent) goToContent();
  };

  /** Of the shown moment and of now, so that dragging through time keeps the view. */
  const content = (state: AppState): Content | null => {
    const shown = contentOf(selectShown(state), lastField);
    return selectShown(state).moment === null
      ? shown
      : together(contentOf(selectLatest(state), null), shown);
  };

  const goToContent = (): void => {
    const state = store.get();
    camera.goTo(state.view.camera, content(state), covered);
  };

  const pinAt = (point: CanvasPoint, reach: number): Pin | null => {
    const state = store.get();
    if (!state.view.layers.has('pins')) return null;
    return nearest(painter.scene(state, now()).pins, state.viewport.view, point, reach);
  };

  const hover = (pin: Pin | null): void => {
    act({ hovered: pin?.id ?? null });
    if (pinUnderMouse.get()?.tagId === pin?.id) return;
    const { view, size } = store.get().viewport;
    pinUnderMouse.set(
      pin && {
        tagId: pin.id,
        at: toCanvas(view, pin.at),
        reach: pinRadius(view.scale),
        within: size,
      },
    );
  };

  const pointOf = (event: PointerEvent | MouseEvent): CanvasPoint => {
    const box = element.getBoundingClientRect();
    return canvasPoint(event.clientX - box.left, event.clientY - box.top);
  };

  const onPointerMove = (event: PointerEvent): void => {
    if (event.pointerType === 'touch') return;
    const point = pointOf(event);
    pointedAt.set(toMap(store.get().viewport.view, point));
    const pin = event.buttons === 0 ? pinAt(point, MOUSE_REACH) : null;
    hover(pin);
    const hand = pin === null || isFixed ? 'grab' : 'point';
    if (element.dataset['hand'] !== hand) element.dataset['hand'] = hand;
  };
  const onPointerLeave = (): void => {
    pointedAt.set(crosshair ? centre() : null);
    hover(null);
  };
  const onClick = (event: MouseEvent): void => {
    const isTouch = event instanceof PointerEvent && event.pointerType === 'touch';
    const point = pointOf(event);
    if (isTouch) pointedAt.set(toMap(store.get().viewport.view, point));
    act(withTag(pinAt(point, isTouch ? TOUCH_REACH : MOUSE_REACH)?.id ?? null));
  };
  const setCrosshair = (on: boolean): void => {
    crosshair = on;
    pointedAt.set(on ? centre() : null);
    spoil('overlay');
  };
  /** Switches to the keyboard: the read-out follows the crosshair. */
  const aim = (): void => {
    if (!crosshair) setCrosshair(true);
  };
  const onFocus = (): void => setCrosshair(element.matches(':focus-visible'));
  const onBlur = (): void => setCrosshair(false);
  const onKeyDown = (event: KeyboardEvent): void => {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    if (event.key === 'Enter' || event.key === ' ') {
      aim();
      act(withTag(pinAt(middle(), 60)?.id ?? null));
      event.preventDefault();
      return;
    }
    const action = keyAction(event);
    if (!action) return;
    aim();
    event.preventDefault();
    action(actions);
  };

  const show = (tagId: string): void => {
    const tag = selectTag(store.get(), tagId);
    if (tag?.at) camera.show(tag.at, covered);
  };
  const actions: MapActions = {
    show,
    fit: () => {
      act({ camera: null });
      goToContent();
    },
    zoomBy: (factor) => camera.zoomBy(factor),
    panBy: (x, y) => camera.panBy(x, y),
  };
  theMap.set(actions);

  /** True also while the map has no size. */
  const isChosenSeen = (): boolean => {
    const state = store.get();
    const { view, size } = state.viewport;
    const at = state.view.selected === null ? null : selectTag(state, state.view.selected)?.at;
    if (!at || size.width === 0) return true;
    const { x, y } = toCanvas(view, at);
    return x > 0 && y > 0 && x < size.width && y < size.height;
  };

  const resize = new ResizeObserver(([entry]) => {
    if (!entry) return;
    const { width, height } = entry.contentRect;
    const wasSeen = isChosenSeen();
    moveViewport({ size: { width, height } });
    if (width === 0 || height === 0) return;
    // For paper, see print.css.
    element.parentElement?.style.setProperty('--map-width', String(width));
    element.parentElement?.style.setProperty('--map-height', String(height));
    // Labels grow with the page's text: on a wall screen, and by the browser's setting.
    const textScale = parseFloat(getComputedStyle(element).fontSize) / TEXT_PX || 1;
    painter.resize({ width, height }, window.devicePixelRatio, textScale);
    covered = coveredBoxes(element);
    goToContent();
    // An opening card takes room from the map.
    const { selected } = store.get().view;
    if (selected !== null && wasSeen) show(selected);
    spoil('still', 'pins', 'overlay');
    // At once: resizing empties a canvas, which would show until the next frame.
    paint();
  });
  resize.observe(element);
  const onCovered = (): void => {
    const before = covered;
    covered = coveredBoxes(element);
    if (JSON.stringify(before) === JSON.stringify(covered)) return;
    goToContent();
    spoil('pins');
  };
  watchCovered(element, onCovered, signal);

  // Pins fade even if nothing arrives, so redraw them regularly.
  const fading = setInterval(() => {
    if (painter.hasFaded(store.get(), now())) spoil('pins');
  }, 5_000);
  // Not `fonts.ready`: it resolves before the font is even requested.
  document.fonts.addEventListener(
    'loadingdone',
    () => {
      painter.forget();
      spoil('still', 'pins');
    },
    { signal },
  );

  store.subscribe(guarded(update), signal);
  marksOnMap.subscribe(() => spoil('pins'), signal);
  onThemeChange(() => {
    painter.recolour();
    spoil('still', 'pins', 'overlay');
    // Not in the next frame: a page being printed gets none.
    cancelAnimationFrame(frame);
    if (store.get().viewport.size.width > 0) paint();
  }, signal);
  element.addEventListener('pointermove', onPointerMove, { signal });
  element.addEventListener('pointerleave', onPointerLeave, { signal });
  if (!isFixed) {
    element.addEventListener('click', onClick, { signal });
    element.addEventListener('focus', onFocus, { signal });
    element.addEventListener('blur', onBlur, { signal });
    element.addEventListener('keydown', onKeyDown, { signal });
  }
  signal.addEventListener('abort', () => {
    theMap.set(null);
    resize.disconnect();
    clearInterval(fading);
    cancelAnimationFrame(frame);
  });
}
