/** The kinds of sensors: the bridge's file that is in force. */
import type { SensorEntry, SensorRanges, SensorsFile } from '../contract/types';
import { LANGUAGE } from '../strings';
import type { Shared } from './memo';

/** The operator's temperature unit. Inside the page, values stay in °C. */
export type TemperatureUnit = 'C' | 'F';

/** From low to high, both included, in the sensor's unit. */
export type Span = readonly [low: number, high: number];

export interface Ranges {
  /** A reading outside it is out of range; null: never judged. */
  readonly ideal: Span | null;
  /** A reading outside it is critical; null: none is. */
  readonly critical: Span | null;
}

/** A kind of sensor, with the ranges of the day or of the night. */
export type Sensor = Shared<ReturnType<typeof sensorOf>>;
export type Catalogue = ReturnType<typeof catalogueOf>;
/** By day and by night. */
export type Catalogues = ReturnType<typeof cataloguesOf>;

/** Whether sensors read it; else it is computed. */
export const isMeasured = ({ madeOf }: Sensor): boolean => madeOf.length === 0;

/** Whether it is computed from one sensor's readings of a day: charts offer it. */
export const isOfDay = ({ madeOf }: Sensor): boolean => madeOf.length === 1;

/** Whether a tag with these sensors has it, or all that it is computed from. */
export const isHad = (
  { name, madeOf }: Pick<Sensor, 'name' | 'madeOf'>,
  has: (sensor: string) => boolean,
): boolean => has(name) || (madeOf.length > 0 && madeOf.every(has));

/** The reading behind a tag's value: a quantity of a day has none of its own. */
export const readingOf = (
  { name, madeOf }: Pick<Sensor, 'name' | 'madeOf'>,
  readings: ReadonlyMap<string, unknown>,
): string => (madeOf.length === 1 && !readings.has(name) && madeOf[0]) || name;

/** The ranges for plants of a species; for an unknown species, those for all. */
export const rangesFor = (sensor: Sensor, species: string): Ranges =>
  sensor.species.get(species.toLowerCase()) ?? sensor;

/** Most cached sensors that the file lacks; tags may invent any number. */
const MOST_OTHERS = 1_000;

function catalogueOf(file: SensorsFile, look: Look, areaOf: (tagId: string) => string) {
  const all = Object.entries(file.sensors).map(([name, entry]) =>
    sensorOf(file, name, entry, look),
  );
  const known = new Map(all.map((sensor) => [sensor.name, sensor]));
  const others = new Map<string, Sensor>();
  const named = (name: string): Sensor => {
    const found = known.get(name) ?? others.get(name);
    if (found) return found;
    const other = sensorOf(file, name, file.fallback, look);
    if (others.size >= MOST_OTHERS) others.clear();
    others.set(name, other);
    return other;
  };
  return {
    all: all as readonly Sensor[],
    /** The area of a tag, by its id; empty: none. */
    areaOf,
    /** A sensor by its name on the wire; an undeclared one looks like the fallback. */
    named,
    /** All sensors to offer: declared ones that a tag reports or that can be computed; others by name. */
    with: (reported: Iterable<string>): readonly Sensor[] => {
      const names = new Set(reported);
      const isOffered = (sensor: Sensor): boolean =>
        names.has(sensor.name) || (!isOfDay(sensor) && isHad(sensor, (name) => names.has(name)));
      const rest = [...names].filter((name) => !known.has(name)).sort();
      return [...all.filter(isOffered), ...rest.map(named)];
    },
  };
}

/** The area of a tag: the first one in the file that names it. */
function areasOf({ areas = {} }: SensorsFile): (tagId: string) => string {
  const byId = new Map<string, string>();
  const begins: [prefix: string, area: string][] = [];
  for (const [area, tags] of Object.entries(areas)) {
    for (const tag of tags) {
      if (tag.endsWith('*')) begins.push([tag.slice(0, -1), area]);
      else if (!byId.has(tag)) byId.set(tag, area);
    }
  }
  return (tagId) =>
    byId.get(tagId) ?? begins.find(([prefix]) => tagId.startsWith(prefix))?.[1] ?? '';
}

/** What a sensor is shown with. */
interface Look {
  readonly isDay: boolean;
  readonly unit: TemperatureUnit;
  readonly language: string;
}

export function cataloguesOf(
  file: SensorsFile,
  unit: TemperatureUnit = 'C',
  language: string = LANGUAGE,
) {
  const areaOf = areasOf(file);
  const by = (isDay: boolean): Catalogue => catalogueOf(file, { isDay, unit, language }, areaOf);
  return { day: by(true), night: by(false) };
}

function sensorOf(
  file: SensorsFile,
  name: string,
  entry: SensorEntry,
  { isDay, unit, language }: Look,
) {
  const { hue, lightness, derived: madeOf = [] } = entry;
  const isFahrenheit = unit === 'F' && entry.unit === '°C';
  return {
    /** On the wire. */
    name,
    /** In the page's language, if the file has it. */
    label: entry.labels?.[language] ?? (entry.label || name),
    /** The same in every language, for files that programs read. */
    dataLabel: entry.label || name,
    /** In which its values are shown; empty when unknown. */
    unit: isFahrenheit ? '°F' : entry.unit,
    /** From a value of the file's unit to the shown one. */
    factor: isFahrenheit ? 1.8 : 1,
    offset: isFahrenheit ? 32 : 0,
    /** Degrees and percents of the ramp's colour. */
    hue,
    lightness,
    saturation: file.ramp.saturation,
    /** Of the heat map at the maximum. */
    maxAlpha: file.ramp.max_alpha,
    /** Digits after the point of every value; null: as many as the value's size needs. */
    digits: digitsOf([entry]) ?? digitsOf(madeOf.map((of) => file.sensors[of])),
    /** The sensors that it is computed from, by the bridge. */
    madeOf,
    /** Whether its ranges are those of day or night; null: both are the same. */
    part: entry.night ? (isDay ? ('day' as const) : ('night' as const)) : null,
    ...rangesOf(entry, isDay),
    /** Species with their own ranges, by name in lower case. */
    species: new Map(
      Object.entries(entry.species ?? {}).map(([species, ranges]) => [
        species.toLowerCase(),
        rangesOf(ranges, isDay),
      ]),
    ),
  };
}

/** What the file leaves out for the night holds as by day. */
function rangesOf(entry: SensorRanges, isDay: boolean): Ranges {
  const { ideal, critical } = isDay ? entry : (entry.night ?? entry);
  return { ideal: spanOf(ideal), critical: spanOf(critical) };
}

/** Digits that show the largest limit to about three figures: 1.30 kPa, 26.0 °C, 1500 ppm. */
function digitsOf(entries: readonly (SensorEntry | undefined)[]): number | null {
  const limits = entries
    .flatMap((entry) => [entry, ...Object.values(entry?.species ?? {})])
    .flatMap((ranges) => [...(ranges?.ideal ?? []), ...(ranges?.night?.ideal ?? [])]);
  const most = Math.max(0, ...limits.map(Math.abs));
  return most > 0 ? Math.max(0, Math.min(6, 3 - Math.ceil(Math.log10(most)))) : null;
}

function spanOf(bounds: readonly number[] | null | undefined): Span | null {
  const [low, high] = bounds ?? [];
  return low !== undefined && high !== undefined ? [low, high] : null;
}

/** Until the file arrives: sensors have only their names, and none is judged. */
export const NO_CATALOGUES: Catalogues = cataloguesOf({
  ramp: { saturation: 0, max_alpha: 0 },
  fallback: { label: '', unit: '', hue: 0, lightness: 50, ideal: null },
  sensors: {},
});
