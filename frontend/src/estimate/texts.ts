/** Values with their errors, as the page writes them. */
import { differenceNumber, valueText, withUnit, written } from '../domain/format';
import type { Sensor } from '../domain/sensors';
import { plusMinus } from '../domain/sureness';
import { differenceToShown, type TemperatureUnit } from '../domain/units';

/** Half the width of the range that nine of ten values lie in: "1.3 °C". */
export const errorText = (sensor: Sensor, sd: number, unit: TemperatureUnit): string =>
  withUnit(sensor, differenceNumber(sensor, plusMinus(sd), unit), unit);

/** "22.4 ± 1.3 °C": the error as exact as the value, unless nothing would be left of it. */
export function estimateText(
  sensor: Sensor,
  mean: number,
  sd: number,
  unit: TemperatureUnit,
): string {
  const value = valueText(sensor, mean, unit);
  const digits = /\D(\d+)$/.exec(value)?.[1]?.length ?? 0;
  const short = written(differenceToShown(sensor, plusMinus(sd), unit).toFixed(digits));
  const told =
    /[1-9]/.test(short) && !value.includes('e')
      ? short
      : differenceNumber(sensor, plusMinus(sd), unit);
  return withUnit(sensor, `${value}\u00a0±\u00a0${told}`, unit);
}
