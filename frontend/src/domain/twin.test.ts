import { describe, expect, test } from 'vitest';

import { readings, stateFrame, tag, wireTag } from '../testing/tags';
import { compareIds, snapshotOf } from './twin';

const pose = (x: number | null, w: number | null): ReturnType<typeof wireTag>['pose'] => ({
  position: { x, y: 2, z: 0 },
  orientation: { x: 0, y: 0, z: 0, w },
});

describe('pose', () => {
  test('w = 0 is no pose: the tag is listed and has no pin', () => {
    expect(tag({ pose: pose(1, 0) }).at).toBeNull();
    expect(tag().at).toEqual({ x: 1, y: 2 });
  });

  test('a tiny w is a half turn, and a pose', () => {
    expect(tag({ pose: pose(1, 6e-17) }).at).not.toBeNull();
  });

  test('a coordinate that is no number is no pose', () => {
    expect(tag({ pose: pose(null, 1) }).at).toBeNull();
  });
});

test('a bloom without a place is left out, a NaN reading is kept as null', () => {
  const made = tag({
    readings: readings({ co2: null, light: 800 }),
    flowers: [
      {
        position: { x: null, y: 1, z: 0 },
        height_m: 0.1,
        species: 'rose',
        confidence: 1,
        anomaly: false,
      },
      {
        position: { x: 1, y: 1, z: 0 },
        height_m: null,
        species: 'rose',
        confidence: null,
        anomaly: true,
      },
    ],
  });
  expect([...made.readings]).toEqual([
    ['co2', null],
    ['light', 800],
  ]);
  expect(made.blooms).toEqual([{ at: { x: 1, y: 1 }, species: 'rose', anomaly: true }]);
});

describe('snapshot', () => {
  test('tags are in the order of their ids, numbers by value', () => {
    const ids = ['10', '9', 'b', '1', 'a'].map((tag_id) => wireTag({ tag_id }));
    expect(snapshotOf(stateFrame(ids), 0, null).tags.map(({ id }) => id)).toEqual([
      '1',
      '9',
      '10',
      'a',
      'b',
    ]);
    expect(compareIds('01', '1')).not.toBe(0);
  });

  test('a repeated state does not look fresh again', () => {
    const first = snapshotOf(stateFrame([wireTag()], { sec: 5 }), 1000, null);
    const heartbeat = snapshotOf(stateFrame([wireTag()], { sec: 5, seq: 2 }), 9000, first);
    expect(heartbeat.takenAt).toBe(1000);
    const news = snapshotOf(stateFrame([wireTag()], { sec: 6, seq: 3 }), 9500, heartbeat);
    expect(news.takenAt).toBe(9500);
  });

  test('a tag’s age is its age on the wire plus the time since the frame', () => {
    const made = snapshotOf(stateFrame([wireTag({ stale_seconds: 4 })]), 10_000, null);
    expect(made.tags[0]?.observedAt).toBe(6_000);
    const never = snapshotOf(stateFrame([wireTag({ stale_seconds: null })]), 10_000, null);
    expect(never.tags[0]?.observedAt).toBeNull();
  });

  test('an unchanged tag is the same object, whatever its age; a changed one is not', () => {
    const first = snapshotOf(stateFrame([wireTag({ stale_seconds: 1 })], { sec: 1 }), 1_000, null);
    const later = stateFrame([wireTag({ stale_seconds: 2.1 })], { sec: 2 });
    expect(snapshotOf(later, 2_000, first).tags[0]).toBe(first.tags[0]);
    const read = stateFrame([wireTag({ readings: readings({ co2: 1 }) })], { sec: 2 });
    expect(snapshotOf(read, 2_000, first).tags[0]).not.toBe(first.tags[0]);
  });

  test('in simulation at ten times the speed ages follow the twin’s clock', () => {
    const first = snapshotOf(stateFrame([wireTag({ stale_seconds: 1 })], { sec: 1 }), 1_000, null);
    const later = stateFrame([wireTag({ stale_seconds: 11 })], { sec: 11 });
    expect(snapshotOf(later, 2_000, first).tags[0]?.observedAt).toBe(-9_000);
  });

  test('names the tags that were observed since the last one', () => {
    const a = wireTag({ tag_id: 'a' });
    const b = wireTag({ tag_id: 'b' });
    const found = wireTag({
      tag_id: 'c',
      stale_seconds: null,
      last_observed: { sec: 0, nanosec: 0 },
    });
    const first = snapshotOf(stateFrame([a, b]), 0, null);
    expect(first.fresh).toEqual([]);
    const again = { ...b, last_observed: { sec: 101, nanosec: 0 } };
    expect(snapshotOf(stateFrame([a, again, found]), 1, first).fresh).toEqual(['b']);
  });

  test('a frame that changes nothing keeps the very list; one that changes a tag, the others', () => {
    const wires = ['1', '2', '10'].map((tag_id) => wireTag({ tag_id }));
    const first = snapshotOf(stateFrame(wires, { sec: 1 }), 1_000, null);
    const beat = snapshotOf(stateFrame(structuredClone(wires), { sec: 2 }), 1_100, first);
    expect(beat).not.toBe(first);
    expect(beat.tags).toBe(first.tags);
    const read = [...wires.slice(1), wireTag({ tag_id: '1', readings: readings({ co2: 1 }) })];
    const news = snapshotOf(stateFrame(read, { sec: 3 }), 1_200, beat);
    expect(news.tags.map(({ id }) => id)).toEqual(['1', '2', '10']);
    expect(news.tags.map((tag, i) => tag === first.tags[i])).toEqual([false, true, true]);
    const gone = snapshotOf(stateFrame(wires.slice(1), { sec: 4 }), 1_300, beat);
    expect(gone.tags.map(({ id }) => id)).toEqual(['2', '10']);
    const other = [wireTag({ tag_id: '11' }), ...wires.slice(0, 2)];
    const swapped = snapshotOf(stateFrame(other, { sec: 5 }), 1_400, beat);
    expect(swapped.tags.map(({ id }) => id)).toEqual(['1', '2', '11']);
  });
});
