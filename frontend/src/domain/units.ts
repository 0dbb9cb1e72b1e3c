import type { Sensor } from './sensors';

/** What the operator reads temperatures in. Everything inside the page stays in °C. */
export type TemperatureUnit = 'C' | 'F';

const inFahrenheit = (sensor: Sensor, unit: TemperatureUnit): boolean =>
  unit === 'F' && sensor.unit === '°C';

export function unitOf(sensor: Sensor, unit: TemperatureUnit): string {
  return inFahrenheit(sensor, unit) ? '°F' : sensor.unit;
}

/** A value as shown. */
export function toShown(sensor: Sensor, value: number, unit: TemperatureUnit): number {
  return inFahrenheit(sensor, unit) ? value * 1.8 + 32 : value;
}

/** A difference of two values as shown: the offset of 32 falls out. */
export function differenceToShown(sensor: Sensor, value: number, unit: TemperatureUnit): number {
  return inFahrenheit(sensor, unit) ? value * 1.8 : value;
}

/** The reverse of `toShown`, for numbers that the operator types. */
export function fromShown(sensor: Sensor, value: number, unit: TemperatureUnit): number {
  return inFahrenheit(sensor, unit) ? (value - 32) / 1.8 : value;
}
