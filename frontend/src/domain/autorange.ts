/** The range of colours where nobody has fixed one: calm, and no alarm where nothing is wrong. Pure. */
import type { Range } from './ramp';
import type { Span } from './sensors';

/** A side gives way only when this share of the range lies idle behind it. */
const IDLE = 0.3;

/**
 * The range to go on with: what the data need, on round numbers. It widens at once and narrows only
 * when much of it lies idle, so that values that come and go at its edge do not make it flicker.
 */
export function heldRange(before: Range | null, data: Range): Range {
  const wanted = rounded(data);
  if (!before) return wanted;
  const width = before.high - before.low;
  const low = sideOf(before.low, wanted.low, wanted.low < before.low, width, data.low);
  const high = sideOf(before.high, wanted.high, wanted.high > before.high, width, data.high);
  return low === before.low && high === before.high ? before : { low, high };
}

function sideOf(
  held: number,
  wanted: number,
  isWider: boolean,
  width: number,
  needed: number,
): number {
  if (isWider) return wanted;
  return Math.abs(held - needed) > IDLE * width ? wanted : held;
}

/** Outwards to about a tenth of its width; one without a width stays as it is. */
export function rounded({ low, high }: Range): Range {
  const width = high - low;
  if (!(width > 0)) return { low, high };
  const step = 10 ** Math.floor(Math.log10(width) - 0.5);
  const round = (value: number): number => Number(value.toPrecision(12));
  return { low: round(Math.floor(low / step) * step), high: round(Math.ceil(high / step) * step) };
}

/** With all of the ideal range in it: a house that is ideal is nowhere near the top of its colours. */
export function withIdeal({ low, high }: Range, ideal: Span | null): Range {
  if (!ideal) return { low, high };
  return { low: Math.min(low, ideal[0]), high: Math.max(high, ideal[1]) };
}
