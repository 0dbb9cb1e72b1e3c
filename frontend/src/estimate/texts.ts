/** Values with their errors, as the page writes them. */
import { differenceNumber, numberText, valueText, withUnit } from '../domain/format';
import type { Sensor } from '../domain/sensors';
import { plusMinus } from '../domain/sureness';
import { differenceToShown, type TemperatureUnit } from '../domain/units';

/** As exact as a value, unless nothing would be left of it. */
function errorNumber(sensor: Sensor, sd: number, unit: TemperatureUnit): string {
  const text = differenceNumber(sensor, plusMinus(sd), unit);
  return /[1-9]/.test(text) ? text : numberText(differenceToShown(sensor, plusMinus(sd), unit));
}

/** Half the width of the range that nine of ten values lie in: "1.3 °C". */
export const errorText = (sensor: Sensor, sd: number, unit: TemperatureUnit): string =>
  withUnit(sensor, errorNumber(sensor, sd, unit), unit);

/** "22.4 ± 1.3 °C". */
export const estimateText = (
  sensor: Sensor,
  mean: number,
  sd: number,
  unit: TemperatureUnit,
): string =>
  withUnit(
    sensor,
    `${valueText(sensor, mean, unit)}\u00a0±\u00a0${errorNumber(sensor, sd, unit)}`,
    unit,
  );
