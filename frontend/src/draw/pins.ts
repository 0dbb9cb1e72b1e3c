/** Pins, blooms, pest rings and labels: what changes with the data. All from cached sprites. */
import { isBad, VERDICTS } from '../domain/health';
import { type BloomLook, MARKS } from '../domain/marks';
import { rgbText } from '../domain/ramp';
import type { LabelRequest, PlacedLabel } from '../geometry/clear';
import { type MapPoint, toCanvas } from '../geometry/coordinates';
import type { Colours } from './colours';
import { CROWD, type Pin, type Scene } from './scene';
import type { Pen, Surface } from './surface';

/** `text`: scale of the page's text, usually 1. */
export const labelHeight = (text: number): number => Math.round(18 * text);
export const labelFont = (text: number): string =>
  `600 ${11.5 * text}px "Inter Variable", system-ui, sans-serif`;
const LABEL_PADDING = 5;

/**
 * Half a pin's width in pixels: smaller when zoomed out, and for crowded pins (`spacing`, m), so that
 * the heat map shows between them.
 */
export function pinRadius(scale: number, spacing = Infinity): number {
  const usual = Math.round(Math.min(11, Math.max(5, scale * 0.11)));
  return Math.min(usual, Math.max(LEAST_PX.healthy, Math.round(scale * spacing * 0.22)));
}

/** Closer together than this, CSS pixels, pins would hide the heat map: healthy ones are left out. */
const LEAST_SPACING_PX = 8;
/** Least size of crowded pins: the worse, the larger. */
const LEAST_PX = { healthy: 2, unknown: 2, stressed: 2, critical: 4 };
/** Smaller pins have no room for a sign. */
const LEAST_SIGN_PX = 5;

export function bloomRadius(scale: number): number {
  return Math.round(Math.min(6, Math.max(1.5, scale * 0.022)) * 2) / 2;
}

const inside = ({ size }: Surface, x: number, y: number, margin: number): boolean =>
  x > -margin && y > -margin && x < size.width + margin && y < size.height + margin;

/** Pixels a metre below which a box's blooms are one blot, which would hide the heat map. */
const LEAST_BLOOM_SCALE = 15;

export function drawBlooms(pen: Pen, blooms: Scene['blooms']): void {
  const { view, sprites, colour } = pen;
  if (view.scale < LEAST_BLOOM_SCALE) return;
  const radius = bloomRadius(view.scale);
  const box = Math.ceil(radius * 1.3 + 2) * 2;
  for (const { at, look } of blooms) {
    const { x, y } = toCanvas(view, at);
    if (!inside(pen, x, y, box)) continue;
    const key = `bloom ${radius} ${look.shape} ${look.colour.join()}`;
    const sprite = sprites.get(key, box, box, (context) => {
      context.translate(box / 2, box / 2);
      paintBloom(context, radius, look, colour);
    });
    sprites.draw(pen, sprite, x - box / 2, y - box / 2);
  }
}

/** SVG paths about the origin at radius 1; the shapes have about the same area. */
const BLOOMS = {
  circle: MARKS.healthy.outline,
  square: 'M-.89-.89H.89V.89H-.89Z',
  triangle: 'M0-1.3L1.2.85H-1.2Z',
} as const;

/** A bloom about the origin. */
function paintBloom(
  context: CanvasRenderingContext2D,
  radius: number,
  look: BloomLook,
  colour: Colours,
): void {
  const outline = new Path2D(BLOOMS[look.shape]);
  context.scale(radius, radius);
  // The colour alone would not stand out from a heat map over a planter.
  context.strokeStyle = colour('map-halo');
  context.lineWidth = 2.5 / radius;
  context.stroke(outline);
  context.fillStyle = rgbText(look.colour);
  context.fill(outline);
  context.strokeStyle = colour('map-bloom-line');
  context.lineWidth = 0.75 / radius;
  context.stroke(outline);
}

const WARNING_PX = 1;

const BY_SEVERITY = [...VERDICTS].reverse();

export function drawPins(pen: Pen, pins: readonly Pin[], spacing: number): void {
  const { context: target, view, sprites, colour } = pen;
  const usual = pinRadius(view.scale, spacing);
  const isTooDense = view.scale * spacing < LEAST_SPACING_PX;
  for (const verdict of BY_SEVERITY) {
    if (isTooDense && verdict === 'healthy') continue;
    const size = Math.max(usual, LEAST_PX[verdict]);
    const box = (size + WARNING_PX + 4) * 2;
    for (const pin of pins) {
      if (pin.verdict !== verdict) continue;
      // Without the sensor in view, a healthy tag has little to say here.
      const isQuiet = pin.kind === 'lacking' && verdict === 'healthy';
      const radius = isQuiet ? Math.round(size * 0.8) : size;
      const { x, y } = toCanvas(view, pin.at);
      if (!inside(pen, x, y, box)) continue;
      const key = `pin ${radius} ${verdict} ${pin.kind}`;
      const sprite = sprites.get(key, box, box, (context) => {
        context.translate(box / 2, box / 2);
        paintPin(context, radius, pin, colour);
      });
      target.globalAlpha = pin.strength;
      sprites.draw(pen, sprite, x - box / 2, y - box / 2);
      target.globalAlpha = 1;
    }
  }
  // Last and never faded, so that no neighbour covers a warning.
  for (const pin of pins) {
    if (!pin.pest) continue;
    const { x, y } = toCanvas(view, pin.at);
    const radius = Math.max(usual, LEAST_PX.critical);
    if (inside(pen, x, y, radius * 8)) drawPest(pen, x, y, radius);
  }
}

/**
 * The mark of a verdict about the origin. Its body shows the sensor in view: full with a reading,
 * empty with a broken outline without such a sensor, empty and struck through if the sensor gives no
 * number.
 */
function paintPin(
  context: CanvasRenderingContext2D,
  pinSize: number,
  { verdict, kind }: Pick<Pin, 'verdict' | 'kind'>,
  colour: Colours,
): void {
  const mark = MARKS[verdict];
  const isWarning = isBad(verdict);
  const radius = pinSize + (isWarning ? WARNING_PX : 0);
  const isEmpty = kind !== 'value';
  const isLine = isEmpty || mark.sign === '';
  const outline = new Path2D(mark.outline);
  context.scale(radius, radius);
  context.lineJoin = 'round';
  context.lineCap = 'round';
  // The halo separates it from any colour below.
  context.strokeStyle = colour('map-halo');
  context.lineWidth = (radius < LEAST_SIGN_PX ? 1.5 : isLine ? 5 : 4) / radius;
  context.stroke(outline);
  context.fillStyle = colour(isEmpty ? 'pin-unknown' : `pin-${verdict}`);
  context.fill(outline);
  context.strokeStyle = colour(isLine ? verdict : 'pin-line');
  context.lineWidth = isLine ? Math.min(2 / radius, 0.4) : 1.25 / radius;
  // A small circle would be corners.
  if (kind === 'lacking' && radius >= LEAST_SIGN_PX) context.setLineDash([3 / radius, 3 / radius]);
  context.stroke(outline);
  context.setLineDash([]);
  // Too small for a sign: a dot.
  if (radius < LEAST_SIGN_PX) return;
  context.strokeStyle = colour(isEmpty ? verdict : `pin-${verdict}-ink`);
  context.lineWidth = Math.max(1.5 / radius, 0.24);
  context.stroke(new Path2D(kind === 'failed' ? STRUCK : mark.sign));
}

/** The sensor exists but gives no number. */
const STRUCK = 'M-.45.45L.45-.45';

function drawPest(pen: Pen, x: number, y: number, radius: number): void {
  const { sprites, colour } = pen;
  const ring = radius + 6;
  const box = (ring + 10) * 2;
  const sprite = sprites.get(`pest ${radius}`, box, box, (context) => {
    context.translate(box / 2, box / 2);
    context.strokeStyle = colour('critical');
    context.lineWidth = 2;
    context.setLineDash([5, 3.5]);
    context.beginPath();
    context.arc(0, 0, ring, 0, 2 * Math.PI);
    context.stroke();
    context.setLineDash([]);
    context.translate(ring * 0.74, -ring * 0.74);
    // Small pins are close together.
    context.scale(radius < 8 ? 0.8 : 1, radius < 8 ? 0.8 : 1);
    paintBug(context, colour);
  });
  sprites.draw(pen, sprite, x - box / 2, y - box / 2);
}

/** A bug on a disc about the origin: no verdict has this shape. */
function paintBug(context: CanvasRenderingContext2D, colour: Colours): void {
  context.beginPath();
  context.arc(0, 0, 7, 0, 2 * Math.PI);
  context.strokeStyle = colour('map-halo');
  context.lineWidth = 3;
  context.stroke();
  context.fillStyle = colour('critical');
  context.fill();
  context.strokeStyle = colour('map-pest-ink');
  context.fillStyle = colour('map-pest-ink');
  context.lineWidth = 1;
  context.stroke(new Path2D('M-4.2-1.5H4.2M-4.2 1H4.2M-4.2 3.2H4.2'));
  context.beginPath();
  context.ellipse(0, 1, 2.1, 3.4, 0, 0, 2 * Math.PI);
  context.fill();
  context.beginPath();
  context.arc(0, -3.3, 1.4, 0, 2 * Math.PI);
  context.fill();
}

/** Pins closer together than a label with a value is wide cannot all be named, CSS pixels. */
const LABELLED_PX = 70;

/**
 * Input of `placeLabels`, relative to the map's origin. Among pins too crowded for labels, only the worst are
 * named, over their neighbours: labels of those at the edge alone would say nothing.
 */
export function labelRequests(
  { pins, spacing }: Pick<Scene, 'pins' | 'spacing'>,
  scale: number,
  first: string | null,
  widthOf: (text: string) => number,
): LabelRequest[] {
  const radius = pinRadius(scale);
  // Clear of the rings of selection and pests.
  const around = (pin: Pin): number => (pin.id === first ? 10 : pin.pest ? 6 : 0);
  const listed = pins.filter(({ texts }) => texts.length > 0);
  const isCrowded = listed.length >= CROWD && spacing * scale < LABELLED_PX;
  const named = isCrowded
    ? listed.filter(({ id, verdict, pest }) => verdict === 'critical' || pest || id === first)
    : pins;
  return named.map((pin) => ({
    id: pin.id,
    x: pin.at.x * scale,
    y: -pin.at.y * scale,
    radius: radius + around(pin),
    priority: pin.id === first ? 100 : pin.priority,
    texts: pin.texts.map((text) => ({ text, width: widthOf(text) + 2 * LABEL_PADDING })),
  }));
}

export function drawLabels(pen: Pen, labels: readonly PlacedLabel[]): void {
  const { view, sprites, colour, textScale } = pen;
  const height = labelHeight(textScale);
  for (const { text, x, y, width } of labels) {
    if (!inside(pen, view.x + x, view.y + y, width + height)) continue;
    const sprite = sprites.get(`label ${text}`, width, height, (context) => {
      context.fillStyle = colour('map-label');
      context.beginPath();
      context.roundRect(0, 0, width, height, 5);
      context.fill();
      context.font = labelFont(textScale);
      context.fillStyle = colour('map-label-text');
      context.textBaseline = 'middle';
      context.fillText(text, LABEL_PADDING, height / 2 + 0.5);
    });
    sprites.draw(pen, sprite, view.x + x, view.y + y);
  }
}

/** In the accent colour, with a halo that separates it from any colour below. */
function drawOutlined({ context, colour }: Pen, lines: Path2D, halo: number, width: number): void {
  context.strokeStyle = colour('map-halo');
  context.lineWidth = halo;
  context.stroke(lines);
  context.strokeStyle = colour('accent');
  context.lineWidth = width;
  context.stroke(lines);
}

export function drawMark(pen: Pen, at: MapPoint, strong: boolean): void {
  // Outside the pest ring.
  const r = pinRadius(pen.view.scale) + 9;
  const { x, y } = toCanvas(pen.view, at);
  const ring = new Path2D(`M${x - r} ${y}a${r} ${r} 0 1 1 ${2 * r} 0a${r} ${r} 0 1 1 ${-2 * r} 0Z`);
  drawOutlined(pen, ring, strong ? 6 : 4, strong ? 3 : 2);
}

/** The point of the keyboard's read-out: the middle of the view. */
export function drawCrosshair(pen: Pen): void {
  const x = Math.round(pen.size.width / 2) + 0.5;
  const y = Math.round(pen.size.height / 2) + 0.5;
  const cross = `M${x - 12} ${y}h9m6 0h9M${x} ${y - 12}v9m0 6v9`;
  drawOutlined(pen, new Path2D(cross), 4, 1.5);
}
