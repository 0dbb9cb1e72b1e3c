/** What moves by itself or with the pointer: pulses, the chosen pin, the crosshair. */
import { toCanvas, type MapPoint, type View } from '../geometry/coordinates';
import type { Palette } from './palette';
import { pinRadius } from './pins';
import type { Surface } from './surface';

/** How long the ring of a fresh observation grows, ms. */
export const PULSE_MS = 1_200;

export interface Pulse {
  readonly at: MapPoint;
  /** ms on the monotonic clock. */
  readonly since: number;
}

export function drawPulses(
  { context }: Surface,
  view: View,
  pulses: readonly Pulse[],
  now: number,
  palette: Palette,
): void {
  const radius = pinRadius(view.scale);
  context.strokeStyle = palette.accent;
  context.lineWidth = 2;
  for (const { at, since } of pulses) {
    const share = Math.min(1, Math.max(0, (now - since) / PULSE_MS));
    const { x, y } = toCanvas(view, at);
    context.globalAlpha = 1 - share;
    context.beginPath();
    context.arc(x, y, radius + 2 + share * 20, 0, 2 * Math.PI);
    context.stroke();
  }
  context.globalAlpha = 1;
}

export function drawMark(
  { context }: Surface,
  view: View,
  at: MapPoint,
  strong: boolean,
  palette: Palette,
): void {
  // Outside of the ring that tells a pest.
  const radius = pinRadius(view.scale) + 9;
  const { x, y } = toCanvas(view, at);
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.strokeStyle = palette.halo;
  context.lineWidth = strong ? 6 : 4;
  context.stroke();
  context.strokeStyle = palette.accent;
  context.lineWidth = strong ? 3 : 2;
  context.stroke();
}

/** The point whose value the keyboard reads: the middle of the view. */
export function drawCrosshair({ context, size }: Surface, palette: Palette): void {
  const x = Math.round(size.width / 2) + 0.5;
  const y = Math.round(size.height / 2) + 0.5;
  for (const [colour, width] of [
    [palette.halo, 4],
    [palette.accent, 1.5],
  ] as const) {
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.beginPath();
    context.moveTo(x - 12, y);
    context.lineTo(x - 3, y);
    context.moveTo(x + 3, y);
    context.lineTo(x + 12, y);
    context.moveTo(x, y - 12);
    context.lineTo(x, y - 3);
    context.moveTo(x, y + 3);
    context.lineTo(x, y + 12);
    context.stroke();
  }
}
