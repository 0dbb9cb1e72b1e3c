/** Wheel, pinch and drag on the map. */
import { canvasPoint, type CanvasPoint } from '../geometry/coordinates';

/** After moving farther, a press is no click, CSS pixels. */
const CLICK_PX = 6;
/** The wheel's gesture ends after a pause of this length, ms. */
const WHEEL_MS = 150;
/** Zoom of a double click; with Shift out. */
const DOUBLE = 2;

interface Gestures {
  readonly onStart: () => void;
  /** What was at `from` is now at `to`, and `factor` times as large. */
  readonly onMove: (from: CanvasPoint, to: CanvasPoint, factor: number) => void;
  /** No finger is down, and the wheel has come to rest. */
  readonly onEnd: () => void;
}

export function watchGestures(
  element: HTMLElement,
  { onStart, onMove, onEnd }: Gestures,
  signal: AbortSignal,
): void {
  /** Where the mouse, or each finger, presses. */
  const presses = new Map<number, CanvasPoint>();
  let first = canvasPoint(0, 0);
  let isClick = true;
  let wheel: ReturnType<typeof setTimeout> | undefined;

  const pointOf = ({ clientX, clientY }: MouseEvent): CanvasPoint => {
    const { left, top } = element.getBoundingClientRect();
    return canvasPoint(clientX - left, clientY - top);
  };
  /** Between the first two fingers. */
  const grip = () => {
    const [a = first, b = a] = presses.values();
    const spread = Math.hypot(a.x - b.x, a.y - b.y) || 1;
    return { spread, middle: canvasPoint((a.x + b.x) / 2, (a.y + b.y) / 2) };
  };
  const end = (): void => {
    if (presses.size === 0 && wheel === undefined) onEnd();
  };
  const letGo = ({ pointerId }: PointerEvent): void => {
    if (presses.delete(pointerId)) end();
  };
  const onPointerDown = (event: PointerEvent): void => {
    if (event.button !== 0 || event.ctrlKey) return;
    if (presses.size === 0) first = pointOf(event);
    isClick = presses.size === 0;
    presses.set(event.pointerId, pointOf(event));
    element.setPointerCapture(event.pointerId);
    onStart();
  };
  const onPointerMove = (event: PointerEvent): void => {
    if (!presses.has(event.pointerId)) return;
    // Its end is not reported while a context menu is open, or until other buttons are released.
    if ((event.buttons & 1) === 0) {
      letGo(event);
      return;
    }
    const before = grip();
    const at = pointOf(event);
    presses.set(event.pointerId, at);
    const after = grip();
    isClick &&= Math.hypot(at.x - first.x, at.y - first.y) <= CLICK_PX;
    onMove(before.middle, after.middle, after.spread / before.spread);
  };
  const onWheel = (event: WheelEvent): void => {
    event.preventDefault();
    const { deltaY, deltaMode, ctrlKey } = event;
    // Pixels, lines or pages; a pinch on a touchpad arrives with Ctrl, in small steps.
    const unit = [0.002, 0.05, 1][deltaMode] ?? 1;
    onStart();
    onMove(pointOf(event), pointOf(event), 2 ** (-deltaY * unit * (ctrlKey ? 10 : 1)));
    clearTimeout(wheel);
    wheel = setTimeout(() => {
      wheel = undefined;
      end();
    }, WHEEL_MS);
  };
  const onDoubleClick = (event: MouseEvent): void => {
    event.preventDefault();
    onStart();
    onMove(pointOf(event), pointOf(event), event.shiftKey ? 1 / DOUBLE : DOUBLE);
    end();
  };
  // Before the map's own listener: the end of a drag chooses no tag.
  const onClick = (event: MouseEvent): void => {
    if (!isClick) event.stopImmediatePropagation();
    isClick = true;
  };
  element.addEventListener('pointerdown', onPointerDown, { signal });
  element.addEventListener('pointermove', onPointerMove, { signal });
  element.addEventListener('pointerup', letGo, { signal });
  element.addEventListener('pointercancel', letGo, { signal });
  element.addEventListener('wheel', onWheel, { signal, passive: false });
  element.addEventListener('dblclick', onDoubleClick, { signal });
  element.addEventListener('click', onClick, { signal, capture: true });
  signal.addEventListener('abort', () => clearTimeout(wheel));
}
