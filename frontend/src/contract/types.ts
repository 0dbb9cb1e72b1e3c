/** The web contract's types under short names; generated from the server's schema. */
import type { components } from './openapi.gen';
import type { InSeconds } from './stamps';

export type Schemas = InSeconds<components['schemas']>;

/** With the defaults that `frames.ts` restores. */
export type TwinTagState = Required<
  Omit<Schemas['TwinTagState'], 'readings' | 'derived' | 'derived_at'>
> & {
  /** Derived values too. */
  readonly readings: readonly Required<Schemas['SensorReading']>[];
};
export type TagHealth = Required<Omit<Schemas['TagHealth'], 'species'>> &
  Pick<Schemas['TagHealth'], 'species'>;
/** The bridge's verdicts on the greenhouse and each tag. */
export interface Judgement {
  readonly house: Required<Omit<Schemas['HouseHealth'], 'species'>>;
  readonly tags: Readonly<Record<string, TagHealth>>;
}
type TwinState = Omit<Schemas['TwinState'], 'tags'> & {
  readonly tags: readonly TwinTagState[];
};
export type StateFrame = Omit<Schemas['StateFrame'], 'state' | 'health'> & {
  readonly state: TwinState;
  readonly health: Judgement;
};
export type StatusFrame = Schemas['StatusFrame'];
/** The state of the journal. */
export type Journal = Schemas['Journal'];
/** The state of a notification channel: MQTT, the webhook. */
export type Outward = Schemas['Outward'];
export type DeltaFrame = Omit<Schemas['DeltaFrame'], 'changed' | 'health'> & {
  readonly changed: readonly TwinTagState[];
  readonly health: Judgement;
};
export type RobotFrame = Schemas['RobotFrame'];
export type Frame = StateFrame | DeltaFrame | StatusFrame | Schemas['AlarmsFrame'] | RobotFrame;
export type OccupancyGrid = Schemas['OccupancyGrid'];
export type FieldQuality = Schemas['FieldQuality'];
export type TagHistory = Schemas['TagHistory'];
export type History = Schemas['History'];
export type Timeline = Schemas['Timeline'];
/** One episode of a problem at a tag, or in the greenhouse. */
export type Alarm = Schemas['Alarm'];
export type Session = Schemas['Session'];
export type Note = Schemas['Note'];
export type Notes = Schemas['Notes'];
/** A frame also has the number of notes in the log. */
export type Alarms = Schemas['Alarms'] & { readonly notes?: number };
export type HealthReason = Schemas['HealthReason'];
export type Verdict = TagHealth['verdict'];
export type Grade = Schemas['EstimateQualities']['sensors'][string];
/** Each tag's measured value, and the value expected from all other tags. */
export type ExpectedTags = Schemas['ExpectedTags'];
/** Where another tag would help. */
export type Advice = Schemas['Advice'];
export type Place = Schemas['AdvisedPlace'];
/** The robot's own report, and its track. */
export type RobotNow = Omit<RobotFrame, 'type'>;
export type Robot = Schemas['Robot'];
export type WirePoint = Schemas['Point'];

/** The ideal range; readings outside the wider `critical` are critical. */
interface Bounds {
  readonly ideal: readonly number[] | null;
  readonly critical?: readonly number[] | null;
}

/** Ranges by day, and by night if they differ. */
export interface SensorRanges extends Bounds {
  readonly night?: Bounds;
}

export interface SensorEntry extends SensorRanges {
  readonly label: string;
  /** In some or all of the other languages. */
  readonly labels?: Readonly<Record<string, string>>;
  readonly unit: string;
  /** Degrees and percent (HSL). */
  readonly hue: number;
  readonly lightness: number;
  /** The sensors that it is computed from. */
  readonly derived?: readonly string[];
  readonly species?: Readonly<Record<string, SensorRanges>>;
}

/** `/api/sensors`: the file that is in force. */
export interface SensorsFile {
  readonly ramp: { readonly saturation: number; readonly max_alpha: number };
  readonly fallback: SensorEntry;
  readonly sensors: Readonly<Record<string, SensorEntry>>;
  /** Bays, rows, zones: the ids of their tags; one that ends in * matches a prefix. */
  readonly areas?: Readonly<Record<string, readonly string[]>>;
}

/** The latest state, from full frames and deltas. */
export type Latest = Omit<StateFrame, 'type'> & {
  /** False: the journal is incomplete up to this moment. */
  readonly isWhole?: boolean;
};

/** How sure each cell of an estimate is; fields of nearest readings lack it. */
export interface Sureness {
  /** Standard deviation of each cell, in the sensor's unit; not-a-number: dropped with its value. */
  readonly sd: Float32Array;
  /** Below this a cell counts as known. */
  readonly sdKnown: number;
}

export interface Field {
  readonly sensor: string;
  /** Cells. */
  readonly width: number;
  readonly height: number;
  /** Lower left corner of cell (0, 0), metres in the map frame. */
  readonly originX: number;
  readonly originY: number;
  /** Metres per cell. */
  readonly resolution: number;
  /** Over the known cells, in the sensor's unit; both 0 if there are none. */
  readonly valueMin: number;
  readonly valueMax: number;
  /** Tags that contributed. */
  readonly sampleCount: number;
  /** Row-major, row 0 at the bottom (lowest y); not-a-number: not known. */
  readonly values: Float32Array;
  /** Only in an estimate. */
  readonly sureness?: Sureness;
  /** Only for nearest readings in place of an estimate: why there is none. */
  readonly noEstimate?: string;
}
