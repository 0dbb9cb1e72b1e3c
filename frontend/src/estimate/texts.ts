/** Values with their errors, as the page writes them. */
import { numberText, written } from '../domain/format';
import type { Sensor } from '../domain/sensors';
import { plusMinus } from '../domain/sureness';
import { differenceToShown, toShown, unitOf, type TemperatureUnit } from '../domain/units';

/** Held together by no-break spaces. */
const joined = (...parts: readonly string[]): string =>
  parts.filter((part) => part !== '').join('\u00a0');

const errorOf = (sensor: Sensor, sd: number, unit: TemperatureUnit): number =>
  differenceToShown(sensor, plusMinus(sd), unit);

/** Half the width of the range that nine of ten values lie in: "1.3 °C". */
export const errorText = (sensor: Sensor, sd: number, unit: TemperatureUnit): string =>
  joined(numberText(errorOf(sensor, sd, unit)), unitOf(sensor, unit));

/** "22.4 ± 1.3 °C": the error as exact as the value, unless nothing would be left of it. */
export function estimateText(
  sensor: Sensor,
  mean: number,
  sd: number,
  unit: TemperatureUnit,
): string {
  const value = numberText(toShown(sensor, mean, unit));
  const error = errorOf(sensor, sd, unit);
  const digits = /\D(\d+)$/.exec(value)?.[1]?.length ?? 0;
  const short = written(error.toFixed(Math.min(digits, 3)));
  const told = /[1-9]/.test(short) && !value.includes('e') ? short : numberText(error);
  return joined(value, '±', told, unitOf(sensor, unit));
}
