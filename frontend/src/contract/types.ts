/** The web contract's types under short names; generated from the server's schema. */
import type { components } from './openapi.gen';

type Schemas = components['schemas'];

export type StateFrame = Schemas['StateFrame'];
export type StatusFrame = Schemas['StatusFrame'];
export type DeltaFrame = Schemas['DeltaFrame'];
export type Frame = StateFrame | DeltaFrame | StatusFrame;
export type TwinTagState = Schemas['TwinTagState'];
export type OccupancyGrid = Schemas['OccupancyGrid'];
export type FieldQuality = Schemas['FieldQuality'];
export type TagHistory = Schemas['TagHistory'];
export type WirePoint = Schemas['Point'];
export type WireTime = Schemas['Time'];
