/** The web contract's types under short names; generated from the server's schema. */
import type { components } from './openapi.gen';

type Schemas = components['schemas'];

export type StateFrame = Schemas['StateFrame'];
export type StatusFrame = Schemas['StatusFrame'];
/** What the twin dropped in the last minutes, and why. */
export type Drop = Schemas['RecentDrop'];
export type DeltaFrame = Schemas['DeltaFrame'];
export type Frame = StateFrame | DeltaFrame | StatusFrame;
export type TwinTagState = Schemas['TwinTagState'];
export type OccupancyGrid = Schemas['OccupancyGrid'];
export type FieldQuality = Schemas['FieldQuality'];
export type PastTry = Schemas['PastTry'];
export type TagHistory = Schemas['TagHistory'];
export type WirePoint = Schemas['Point'];
export type WireTime = Schemas['Time'];

/** The newest state, put together from full frames and deltas. */
export type Latest = Omit<StateFrame, 'type'>;

/** A reconstructed field of one sensor. */
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
}
