import type { Sensor, Span } from './sensors';

/** Red, green, blue from 0 to 255. */
export type Rgb = readonly [number, number, number];

/** Lowest and highest value of a colour scale, in the sensor's unit. */
export interface Range {
  readonly low: number;
  readonly high: number;
}

/** CSS Color 4, "Converting HSL colors to sRGB". Degrees, percent, percent. */
export function hslToRgb(hue: number, saturation: number, lightness: number): Rgb {
  const s = saturation / 100;
  const l = lightness / 100;
  const channel = (n: number): number => {
    const k = (n + hue / 30) % 12;
    return Math.round(255 * (l - s * Math.min(l, 1 - l) * Math.max(-1, Math.min(k - 3, 9 - k, 1))));
  };
  return [channel(0), channel(8), channel(4)];
}

/** The one colour of a sensor; values differ in its opacity. */
export function sensorColour(sensor: Sensor): Rgb {
  return hslToRgb(sensor.hue, sensor.saturation, sensor.lightness);
}

/**
 * Position of a value in a range, clamped to 0 to 1. A range of no width gives 1: a single reading
 * shows how far it reaches, as in the bridge's PNG.
 */
export function fraction(range: Range, value: number): number {
  const width = range.high - range.low;
  if (!(width > 0)) return value >= range.low ? 1 : 0;
  return Math.min(1, Math.max(0, (value - range.low) / width));
}

/** The colour of a pixel, by its value and its cell. */
export type Shade = (value: number, cell: number) => { readonly rgb: Rgb; readonly alpha: number };

/** Transparent at the minimum. */
export function fieldShade(sensor: Sensor, range: Range): Shade {
  const rgb = sensorColour(sensor);
  return (value) => ({ rgb, alpha: sensor.maxAlpha * fraction(range, value) });
}

export function mix(from: Rgb, to: Rgb, share: number): Rgb {
  const channel = (a: number, b: number): number => Math.round(a + (b - a) * share);
  return [channel(from[0], to[0]), channel(from[1], to[1]), channel(from[2], to[2])];
}

export function rgbText([r, g, b]: Rgb, alpha = 1): string {
  return alpha === 1 ? `rgb(${r} ${g} ${b})` : `rgb(${r} ${g} ${b} / ${alpha})`;
}

/** Smallest range around the finite values; null without any. */
export function rangeOf(values: Iterable<number | null | undefined>): Range | null {
  let low = Infinity;
  let high = -Infinity;
  for (const value of values) {
    if (value === null || value === undefined || !Number.isFinite(value)) continue;
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  return low <= high ? { low, high } : null;
}

/** A side narrows only if more than this share of the range is unused there. */
const IDLE = 0.3;

/**
 * The next range: what the data need, on round numbers. It widens at once and narrows only when much
 * of it is unused, so that values at its edge do not make it flicker.
 */
export function heldRange(before: Range | null, data: Range): Range {
  const wanted = rounded(data);
  if (!before) return wanted;
  const width = before.high - before.low;
  const end = (of: keyof Range, isWider: boolean): number =>
    isWider || Math.abs(before[of] - data[of]) > IDLE * width ? wanted[of] : before[of];
  const low = end('low', wanted.low < before.low);
  const high = end('high', wanted.high > before.high);
  return low === before.low && high === before.high ? before : { low, high };
}

/** Rounded outwards to about a tenth of its width; a range of no width stays. */
export function rounded({ low, high }: Range): Range {
  const width = high - low;
  if (!(width > 0)) return { low, high };
  const step = 10 ** Math.floor(Math.log10(width) - 0.5);
  const round = (value: number): number => Number(value.toPrecision(12));
  return { low: round(Math.floor(low / step) * step), high: round(Math.ceil(high / step) * step) };
}

/** Extended to the ideal range, so that ideal values stay far from the strongest colour. */
export function withIdeal({ low, high }: Range, ideal: Span | null): Range {
  if (!ideal) return { low, high };
  return { low: Math.min(low, ideal[0]), high: Math.max(high, ideal[1]) };
}

/** Widened on both sides if both ends would read the same: they are rounded to a tenth, or coarser. */
export function withDistinctEnds({ low, high }: Range): Range {
  const middle = (low + high) / 2;
  const size = Math.abs(middle);
  const least = Math.max(0.01 * size, 0.2 * Math.min(1, size)) || 0.2;
  return high - low < least ? { low: middle - least / 2, high: middle + least / 2 } : { low, high };
}
