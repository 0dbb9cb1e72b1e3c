/** The file of sensors that comes with the bridge, as the page gets it from there. */
import file from '../../../backend/lupin_bridge/sensors.json';
import type { SensorsFile } from '../contract/types';
import { cataloguesOf, type Sensor } from '../domain/sensors';

export const FILE: SensorsFile = file;
export const CATALOGUES = cataloguesOf(FILE);
export const CATALOGUE = CATALOGUES.day;

export const sensorNamed = (name: string): Sensor => CATALOGUE.named(name);
