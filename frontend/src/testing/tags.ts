import type { StateFrame, TwinTagState } from '../contract/types';
import { tagOf, type Snapshot, type Tag } from '../domain/twin';
import { NOBODY } from './health';

export function wireTag(over: Partial<TwinTagState> = {}): TwinTagState {
  return {
    tag_id: '1',
    pose: { position: { x: 1, y: 2, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } },
    readings: [],
    last_observed: 100,
    stale_seconds: 5,
    species: '',
    species_confidence: null,
    anomaly: false,
    flower_count: 0,
    bug_count: 0,
    flowers: [],
    box_footprint: { points: [] },
    looked_at: null,
    last_try: null,
    last_try_status: null,
    last_try_detail: '',
    ...over,
  };
}

export const tag = (over: Partial<TwinTagState> = {}): Tag => tagOf(wireTag(over));

export const readings = (
  values: Record<string, number | null>,
  sec = 100,
): TwinTagState['readings'] =>
  Object.entries(values).map(([name, value]) => ({
    name,
    value,
    observed_at: sec,
  }));

export function stateFrame(
  tags: readonly TwinTagState[],
  { seq = 1, sec = 105, revision = 'r1', health = NOBODY } = {},
): StateFrame {
  return {
    type: 'state',
    seq,
    revision,
    state: { header: { stamp: sec, frame_id: 'map' }, tags },
    health,
  };
}

export const snapshot = (tags: readonly Tag[]): Snapshot => ({
  tags,
  revision: 'r1',
  at: 1000,
  takenAt: 0,
  isWhole: true,
});
