/** Pins, blooms, pest rings and labels: what the data moves. All from cached sprites. */
import { mix, rgbText, type Rgb } from '../domain/ramp';
import type { BloomLook } from '../domain/species';
import { toCanvas, type View } from '../geometry/coordinates';
import type { LabelRequest, PlacedLabel } from '../geometry/declutter';
import type { BloomDot, Pin } from './scene';
import type { Palette } from './palette';
import type { Sprites, Surface } from './surface';

/** `text`: how large the page's text is, 1 as usual. */
export const labelHeight = (text: number): number => Math.round(18 * text);
export const labelFont = (text: number): string =>
  `600 ${11.5 * text}px "Inter Variable", system-ui, sans-serif`;
const LABEL_PADDING = 5;

/** Half the diagonal of a pin in pixels: smaller when far away, so that pins stay apart. */
export function pinRadius(scale: number): number {
  return Math.round(Math.min(11, Math.max(5, scale * 0.11)));
}

export function bloomRadius(scale: number): number {
  return Math.round(Math.min(6, Math.max(1.5, scale * 0.022)) * 2) / 2;
}

const inside = ({ size }: Surface, x: number, y: number, margin: number): boolean =>
  x > -margin && y > -margin && x < size.width + margin && y < size.height + margin;

export function drawBlooms(
  surface: Surface,
  view: View,
  blooms: readonly BloomDot[],
  sprites: Sprites,
  palette: Palette,
): void {
  const radius = bloomRadius(view.scale);
  const box = Math.ceil(radius * 1.3 + 2) * 2;
  for (const { at, look } of blooms) {
    const { x, y } = toCanvas(view, at);
    if (!inside(surface, x, y, box)) continue;
    const key = `bloom ${radius} ${look.shape} ${look.colour.join()}`;
    const sprite = sprites.get(key, box, box, (context) => {
      context.translate(box / 2, box / 2);
      paintBloom(context, radius, look, palette);
    });
    sprites.draw(surface, sprite, x - box / 2, y - box / 2);
  }
}

/** A dot about the origin; the shapes have about the same area. */
function paintBloom(
  context: CanvasRenderingContext2D,
  radius: number,
  { colour, shape }: BloomLook,
  palette: Palette,
): void {
  context.beginPath();
  if (shape === 'circle') {
    context.arc(0, 0, radius, 0, 2 * Math.PI);
  } else if (shape === 'square') {
    context.rect(-radius * 0.89, -radius * 0.89, radius * 1.78, radius * 1.78);
  } else {
    context.moveTo(0, -radius * 1.3);
    context.lineTo(radius * 1.2, radius * 0.85);
    context.lineTo(-radius * 1.2, radius * 0.85);
    context.closePath();
  }
  // Its colour alone would not stand out from a heat map over a planter.
  context.strokeStyle = palette.halo;
  context.lineWidth = 2.5;
  context.stroke();
  context.fillStyle = rgbText(colour);
  context.fill();
  context.strokeStyle = palette.bloomLine;
  context.lineWidth = 0.75;
  context.stroke();
}

export function drawPins(
  surface: Surface,
  view: View,
  pins: readonly Pin[],
  colour: Rgb,
  sprites: Sprites,
  palette: Palette,
): void {
  const radius = pinRadius(view.scale);
  const box = (radius + 3) * 2;
  for (const pin of pins) {
    const { x, y } = toCanvas(view, pin.at);
    if (!inside(surface, x, y, box)) continue;
    const key = `pin ${radius} ${pin.kind} ${pin.share} ${colour.join()}`;
    const sprite = sprites.get(key, box, box, (context) => {
      context.translate(box / 2, box / 2);
      paintPin(context, radius, pin.kind, mix(palette.pinBody, colour, pin.share), palette);
    });
    surface.context.globalAlpha = pin.strength;
    sprites.draw(surface, sprite, x - box / 2, y - box / 2);
    surface.context.globalAlpha = 1;
  }
  // Last, so that no neighbour covers a warning; and never faded.
  for (const pin of pins) {
    if (!pin.pest) continue;
    const { x, y } = toCanvas(view, pin.at);
    if (inside(surface, x, y, box * 2)) drawPest(surface, x, y, radius, sprites, palette);
  }
}

/** A diamond about the origin. Hollow and dashed: the tag lacks the sensor. */
function paintPin(
  context: CanvasRenderingContext2D,
  radius: number,
  kind: Pin['kind'],
  fill: Rgb,
  palette: Palette,
): void {
  const diamond = (): void => {
    context.beginPath();
    context.moveTo(0, -radius);
    context.lineTo(radius, 0);
    context.lineTo(0, radius);
    context.lineTo(-radius, 0);
    context.closePath();
  };
  diamond();
  context.lineJoin = 'round';
  context.strokeStyle = palette.halo;
  context.lineWidth = 4;
  if (kind === 'value') context.stroke();
  if (kind === 'value') {
    context.fillStyle = rgbText(fill);
    context.fill();
  }
  context.strokeStyle = palette.pinLine;
  context.lineWidth = kind === 'value' ? 1.5 : 1.25;
  if (kind === 'lacking') context.setLineDash([3, 2.5]);
  context.stroke();
  if (kind === 'failed') {
    // A stroke through it: there is such a sensor, and it gives no number.
    context.beginPath();
    context.moveTo(-radius * 0.5, radius * 0.5);
    context.lineTo(radius * 0.5, -radius * 0.5);
    context.stroke();
  }
}

function drawPest(
  surface: Surface,
  x: number,
  y: number,
  radius: number,
  sprites: Sprites,
  palette: Palette,
): void {
  const ring = radius + 6;
  const box = (ring + 10) * 2;
  const sprite = sprites.get(`pest ${radius}`, box, box, (context) => {
    context.translate(box / 2, box / 2);
    context.strokeStyle = palette.pest;
    context.lineWidth = 2;
    context.setLineDash([5, 3.5]);
    context.beginPath();
    context.arc(0, 0, ring, 0, 2 * Math.PI);
    context.stroke();
    context.setLineDash([]);
    paintWarning(context, ring * 0.74, -ring * 0.74, palette);
  });
  sprites.draw(surface, sprite, x - box / 2, y - box / 2);
}

/** A warning triangle with its mark, centred at (x, y). */
function paintWarning(
  context: CanvasRenderingContext2D,
  x: number,
  y: number,
  palette: Palette,
): void {
  context.save();
  context.translate(x, y);
  context.beginPath();
  context.moveTo(0, -8);
  context.lineTo(8, 6);
  context.lineTo(-8, 6);
  context.closePath();
  context.lineJoin = 'round';
  context.strokeStyle = palette.halo;
  context.lineWidth = 3;
  context.stroke();
  context.fillStyle = palette.pest;
  context.fill();
  context.fillStyle = palette.pestInk;
  context.fillRect(-1, -3.5, 2, 5);
  context.fillRect(-1, 2.6, 2, 2);
  context.restore();
}

/** What `placeLabels` needs to know, relative to the map's origin. */
export function labelRequests(
  pins: readonly Pin[],
  scale: number,
  first: string | null,
  widthOf: (text: string) => number,
): LabelRequest[] {
  const radius = pinRadius(scale);
  return pins.map((pin) => ({
    id: pin.id,
    x: pin.at.x * scale,
    y: -pin.at.y * scale,
    radius: pin.pest ? radius + 6 : radius,
    priority: pin.id === first ? 100 : pin.priority,
    texts: pin.texts.map((text) => ({ text, width: widthOf(text) + 2 * LABEL_PADDING })),
  }));
}

export function drawLabels(
  surface: Surface,
  view: View,
  labels: readonly PlacedLabel[],
  sprites: Sprites,
  palette: Palette,
  textScale = 1,
): void {
  const height = labelHeight(textScale);
  for (const { text, x, y, width } of labels) {
    if (!inside(surface, view.x + x, view.y + y, width + height)) continue;
    const sprite = sprites.get(`label ${text}`, width, height, (context) => {
      context.fillStyle = palette.labelFill;
      context.beginPath();
      context.roundRect(0, 0, width, height, 5);
      context.fill();
      context.font = labelFont(textScale);
      context.fillStyle = palette.labelText;
      context.textBaseline = 'middle';
      context.fillText(text, LABEL_PADDING, height / 2 + 0.5);
    });
    sprites.draw(surface, sprite, view.x + x, view.y + y);
  }
}
