/** Largest of 1, 2, 5 times a power of ten that is not above `value`. */
export function niceFloor(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value));
  const digit = value / power;
  return (digit >= 5 ? 5 : digit >= 2 ? 2 : 1) * power;
}

export interface ScaleBar {
  readonly metres: number;
  readonly pixels: number;
}

/** The longest round length that fits into `maxPixels`. */
export function scaleBar(scale: number, maxPixels: number): ScaleBar {
  const metres = niceFloor(maxPixels / scale);
  return { metres, pixels: metres * scale };
}

/** A round length as text: 20 cm, 5 m, 1 km. */
export function lengthText(metres: number): string {
  if (metres >= 1000) return `${trim(metres / 1000)} km`;
  if (metres >= 1) return `${trim(metres)} m`;
  return `${trim(metres * 100)} cm`;
}

const trim = (value: number): string => String(Number(value.toPrecision(3)));

/** Metres between two lines of the grid, so that they stay at least `minPixels` apart. */
export function gridStep(scale: number, minPixels: number): number {
  const least = minPixels / scale;
  const step = niceFloor(least);
  if (step >= least) return step;
  const digit = Math.round(step / 10 ** Math.floor(Math.log10(step)));
  return step * (digit === 2 ? 2.5 : 2);
}
