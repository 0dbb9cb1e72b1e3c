/** The bridge's default file of sensors, as the page receives it. */
import file from '../../../backend/lupin_bridge/sensors.json';
import type { SensorsFile } from '../contract/types';
import { cataloguesOf, type Sensor, type TemperatureUnit } from '../domain/sensors';

export const FILE: SensorsFile = file;
export const CATALOGUES = cataloguesOf(FILE);
export const CATALOGUE = CATALOGUES.day;
/** With temperatures in °F. */
export const IN_FAHRENHEIT = cataloguesOf(FILE, 'F').day;

export const sensorNamed = (name: string, unit: TemperatureUnit = 'C'): Sensor =>
  (unit === 'C' ? CATALOGUE : IN_FAHRENHEIT).named(name);
