/** What stands below the map in a saved picture: what it shows, of when, and how large it is. */
import { written } from '../domain/format';
import { rgbText, type Rgb } from '../domain/ramp';
import { lengthText, scaleBar } from '../geometry/scale';

export const FOOTER_PX = 56;
const EDGE_PX = 14;
const GAP_PX = 8;
const RAMP_PX = { width: 90, height: 12 } as const;
const LONGEST_BAR_PX = 70;
const FONT = '13px "Inter Variable", system-ui, sans-serif';

export interface Footer {
  /** The sensor, and the date and time. */
  readonly title: string;
  readonly time: string;
  /** The ramp's two ends, the upper one with its unit; null: there is no reading. */
  readonly ends: readonly [low: string, high: string] | null;
  readonly colour: Rgb;
  /** Alpha of the heat map at its maximum. */
  readonly maxAlpha: number;
  /** Colours from the lowest to the highest of a difference; none: more and more of the one. */
  readonly diverging?: readonly string[];
  /** Pixels a metre. */
  readonly scale: number;
}

/** Draws in a strip `width` wide and FOOTER_PX high, whose upper left corner is the origin. */
export function drawFooter(
  context: CanvasRenderingContext2D,
  width: number,
  footer: Footer,
  { ink, surface }: { readonly ink: string; readonly surface: string },
): void {
  context.fillStyle = surface;
  context.fillRect(0, 0, width, FOOTER_PX);
  context.fillStyle = ink;
  context.strokeStyle = ink;
  context.textBaseline = 'middle';
  const right = width - EDGE_PX;

  context.font = `600 ${FONT}`;
  context.fillText(footer.title, EDGE_PX, 18);
  context.font = `500 ${FONT}`;
  context.textAlign = 'right';
  context.fillText(footer.time, right, 18);

  const middle = 40;
  const bar = scaleBar(footer.scale, LONGEST_BAR_PX);
  const length = written(lengthText(bar.metres));
  context.fillText(length, right, middle);
  const end = right - context.measureText(length).width - GAP_PX;
  context.textAlign = 'left';
  context.lineWidth = 2;
  context.beginPath();
  context.moveTo(end - bar.pixels, middle - 4);
  context.lineTo(end - bar.pixels, middle + 3);
  context.lineTo(end, middle + 3);
  context.lineTo(end, middle - 4);
  context.stroke();

  if (!footer.ends) return;
  const [low, high] = footer.ends;
  context.fillText(low, EDGE_PX, middle);
  const left = EDGE_PX + context.measureText(low).width + GAP_PX;
  drawRamp(context, left, middle - RAMP_PX.height / 2, footer);
  context.fillStyle = ink;
  context.fillText(high, left + RAMP_PX.width + GAP_PX, middle);
}

/** The pins' colours above those of the heat map, as in the page's legend. */
function drawRamp(
  context: CanvasRenderingContext2D,
  x: number,
  y: number,
  { colour, maxAlpha, diverging }: Footer,
): void {
  const { width, height } = RAMP_PX;
  [1, maxAlpha].forEach((most, index) => {
    const gradient = context.createLinearGradient(x, 0, x + width, 0);
    const stops = diverging ?? [rgbText(colour, 0), rgbText(colour, most)];
    stops.forEach((stop, place) => {
      gradient.addColorStop(place / (stops.length - 1), stop);
    });
    context.fillStyle = gradient;
    context.fillRect(x, y + (index * height) / 2, width, height / 2);
  });
  context.lineWidth = 1;
  context.strokeRect(x - 0.5, y - 0.5, width + 1, height + 1);
}
