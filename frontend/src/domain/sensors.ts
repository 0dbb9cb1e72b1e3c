import declared from '../../../backend/lupin_bridge/sensors.json';

/** What the page knows about a kind of sensor. The numbers stand once, in `sensors.json`. */
export interface Sensor {
  /** Name on the wire. */
  readonly name: string;
  readonly label: string;
  /** Unit of its readings; empty when unknown. */
  readonly unit: string;
  /** Degrees and percent of the ramp's colour. */
  readonly hue: number;
  readonly lightness: number;
  /** Lowest and highest healthy value, in `unit`; null: readings are never judged. */
  readonly ideal: readonly [low: number, high: number] | null;
}

interface Declaration {
  readonly label: string;
  readonly unit: string;
  readonly hue: number;
  readonly lightness: number;
  readonly ideal: readonly number[] | null;
}

/** Saturation of every ramp (percent) and the heat map's alpha at the maximum. */
export const RAMP = { saturation: declared.ramp.saturation, maxAlpha: declared.ramp.max_alpha };

const declarations = declared.sensors as Readonly<Record<string, Declaration>>;

function toSensor(name: string, { label, unit, hue, lightness, ideal }: Declaration): Sensor {
  const [low, high] = ideal ?? [];
  return {
    name,
    label: label || name,
    unit,
    hue,
    lightness,
    ideal: low !== undefined && high !== undefined ? [low, high] : null,
  };
}

/** The sensors of `sensors.json`, in its order. */
export const KNOWN_SENSORS: readonly Sensor[] = Object.entries(declarations).map(
  ([name, declaration]) => toSensor(name, declaration),
);

const known = new Map(KNOWN_SENSORS.map((sensor) => [sensor.name, sensor]));

/** A sensor by its name on the wire; one that nobody declared gets the fallback's look. */
export function sensorNamed(name: string): Sensor {
  return known.get(name) ?? toSensor(name, declared.fallback);
}

/** All sensors to offer: the declared ones, then others that some tag reports, by name. */
export function sensorsIn(reported: Iterable<string>): readonly Sensor[] {
  const others = [...new Set(reported)].filter((name) => !known.has(name)).sort();
  return others.length === 0 ? KNOWN_SENSORS : [...KNOWN_SENSORS, ...others.map(sensorNamed)];
}
