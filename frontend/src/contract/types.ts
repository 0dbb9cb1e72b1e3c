/** The web contract's types under short names; generated from the server's schema. */
import type { components } from './openapi.gen';

export type Schemas = components['schemas'];

/** With what the server left out, as `frames.ts` puts it back. */
export type TwinTagState = Required<Omit<Schemas['TwinTagState'], 'readings'>> & {
  readonly readings: readonly Required<Schemas['SensorReading']>[];
};
export type TagHealth = Required<Schemas['TagHealth']>;
/** What the bridge's judge says of the house and of each tag. */
export interface Judgement {
  readonly house: Required<Schemas['HouseHealth']>;
  readonly tags: Readonly<Record<string, TagHealth>>;
}
export type TwinState = Omit<Schemas['TwinState'], 'tags'> & {
  readonly tags: readonly TwinTagState[];
};
export type StateFrame = Omit<Schemas['StateFrame'], 'state' | 'health'> & {
  readonly state: TwinState;
  readonly health: Judgement;
};
export type StatusFrame = Schemas['StatusFrame'];
/** Whether what happens is kept, and what of it no robot observed. */
export type Journal = Schemas['Journal'];
/** How a channel does by which others are told: MQTT, the webhook. */
export type Outward = Schemas['Outward'];
export type DeltaFrame = Omit<Schemas['DeltaFrame'], 'changed' | 'health'> & {
  readonly changed: readonly TwinTagState[];
  readonly health: Judgement;
};
export type RobotFrame = Schemas['RobotFrame'];
export type Frame = StateFrame | DeltaFrame | StatusFrame | AlarmsFrame | RobotFrame;
export type OccupancyGrid = Schemas['OccupancyGrid'];
export type FieldQuality = Schemas['FieldQuality'];
export type PastAttempt = Schemas['PastAttempt'];
export type TagHistory = Schemas['TagHistory'];
export type History = Schemas['History'];
export type Timeline = Schemas['Timeline'];
/** One episode of something wrong at a tag, or in the house. */
export type Alarm = Schemas['Alarm'];
export type Session = Schemas['Session'];
export type Note = Schemas['Note'];
export type Notes = Schemas['Notes'];
export type AlarmsFrame = Schemas['AlarmsFrame'];
/** A frame also says how many notes the log has. */
export type Alarms = Schemas['Alarms'] & { readonly notes?: number };
export type HealthReason = Schemas['HealthReason'];
export type Verdict = TagHealth['verdict'];
export type Grade = Schemas['EstimateQualities']['sensors'][string];
/** What was measured at the tags beside what all the others say. */
export type ExpectedTags = Schemas['ExpectedTags'];
/** Where another tag helps. */
export type Advice = Schemas['Advice'];
export type Place = Schemas['AdvisedPlace'];
/** What a robot says of itself; and where it has been. */
export type RobotNow = Omit<RobotFrame, 'type'>;
export type Robot = Schemas['Robot'];
export type WirePoint = Schemas['Point'];
export type WireTime = Schemas['Time'];

/** What should be read: ideal, and critical outside of the wider `critical`. */
interface Bounds {
  readonly ideal: readonly number[] | null;
  readonly critical?: readonly number[] | null;
}

/** By day, and by night where that has its own. */
export interface SensorRanges extends Bounds {
  readonly night?: Bounds;
}

export interface SensorEntry extends SensorRanges {
  readonly label: string;
  /** In other languages, some or all. */
  readonly labels?: Readonly<Record<string, string>>;
  readonly unit: string;
  /** Degrees and percent (HSL). */
  readonly hue: number;
  readonly lightness: number;
  /** The sensors that it is computed of. */
  readonly derived?: readonly string[];
  readonly species?: Readonly<Record<string, SensorRanges>>;
}

/** `/api/sensors`: the file that is in force, as it stands. */
export interface SensorsFile {
  readonly ramp: { readonly saturation: number; readonly max_alpha: number };
  readonly fallback: SensorEntry;
  readonly sensors: Readonly<Record<string, SensorEntry>>;
  /** Bays, rows, zones: the ids of their tags; one that ends in * stands for all that begin so. */
  readonly areas?: Readonly<Record<string, readonly string[]>>;
}

/** The newest state, put together from full frames and deltas. */
export type Latest = Omit<StateFrame, 'type'> & {
  /** False: of what leads up to this moment the journal does not have all. */
  readonly isWhole?: boolean;
};

/** How sure each cell of a field is; the nearest readings alone do not tell. */
export interface Sureness {
  /** Standard deviation, cell by cell as the values, the sensor's unit; not-a-number: not asked. */
  readonly sd: Float32Array;
  /** Below this a cell counts as known. */
  readonly sdKnown: number;
}

/** Why a field is not the estimate that was asked for. */
export interface NoEstimate {
  readonly status: number;
  readonly message: string;
}

export interface Field {
  readonly sensor: string;
  /** Cells. */
  readonly width: number;
  readonly height: number;
  /** Lower left corner of cell (0, 0), metres in the map frame. */
  readonly originX: number;
  readonly originY: number;
  /** Metres a cell. */
  readonly resolution: number;
  /** Over the known cells, in the sensor's unit; both 0 where there is none. */
  readonly valueMin: number;
  readonly valueMax: number;
  /** Tags that contributed. */
  readonly sampleCount: number;
  /** Row-major, row 0 at the bottom (lowest y); not-a-number: not known. */
  readonly values: Float32Array;
  /** Of an estimate alone. */
  readonly sureness?: Sureness;
  /** Of the nearest readings in place of an estimate. */
  readonly noEstimate?: NoEstimate;
}
