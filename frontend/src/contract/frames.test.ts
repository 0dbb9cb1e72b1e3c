import { expect, test } from 'vitest';

import { stateFrame, wireTag } from '../testing/tags';
import { parseFrame } from './frames';

test('reads both kinds of frame', () => {
  const frame = stateFrame([wireTag()]);
  expect(parseFrame(JSON.stringify(frame))).toEqual(frame);
  const status = {
    type: 'status',
    twin: 'offline',
    reason: 'stale',
    message: '',
    state_age_seconds: 4,
  };
  expect(parseFrame(JSON.stringify(status))).toEqual(status);
});

test('reads a delta', () => {
  const header = { stamp: { sec: 1, nanosec: 0 }, frame_id: 'map' };
  const delta = { type: 'delta', seq: 2, base: 1, revision: 'r', header, changed: [], removed: [] };
  expect(parseFrame(JSON.stringify(delta))).toEqual(delta);
  expect(parseFrame(JSON.stringify({ ...delta, removed: null }))).toBeNull();
});

test.each([
  'no json',
  'null',
  '7',
  '[]',
  '{"type":"delta"}',
  '{"type":"state","revision":"r","state":{}}',
  '{"type":"state","revision":"r","state":null}',
  '{"type":"state","state":{"tags":[]}}',
  '{"type":"status"}',
])('passes over %s', (text) => {
  expect(parseFrame(text)).toBeNull();
});
