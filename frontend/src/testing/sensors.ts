/** The bridge's default file of sensors, as the page receives it. */
import file from '../../../backend/lupin_bridge/sensors.json';
import type { SensorsFile } from '../contract/types';
import { cataloguesOf, type Sensor } from '../domain/sensors';

export const FILE: SensorsFile = file;
export const CATALOGUES = cataloguesOf(FILE);
export const CATALOGUE = CATALOGUES.day;

export const sensorNamed = (name: string): Sensor => CATALOGUE.named(name);
