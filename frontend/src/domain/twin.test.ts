import { describe, expect, test } from 'vitest';

import cases from '../../../tests/twin/core/far_off.json';
import type { Latest, TwinTagState } from '../contract/types';
import { mapPoint } from '../geometry/coordinates';
import { NOBODY } from '../testing/health';
import { readings, stateFrame, tag, wireTag } from '../testing/tags';
import { compareIds, holds, reachOf, snapshotOf, tagOf } from './twin';

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
  expect(made.blooms).toEqual([{ at: { x: 1, y: 1 }, species: 'rose' }]);
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

  test('a repeated state is not fresh again', () => {
    const first = snapshotOf(stateFrame([wireTag()], { sec: 5 }), 1000, null);
    const heartbeat = snapshotOf(stateFrame([wireTag()], { sec: 5, seq: 2 }), 9000, first);
    expect(heartbeat.takenAt).toBe(1000);
    const news = snapshotOf(stateFrame([wireTag()], { sec: 6, seq: 3 }), 9500, heartbeat);
    expect(news.takenAt).toBe(9500);
  });

  test('an unchanged tag is the same object, whatever its age; a changed one is not', () => {
    const first = snapshotOf(stateFrame([wireTag({ stale_seconds: 1 })], { sec: 1 }), 1_000, null);
    const later = stateFrame([wireTag({ stale_seconds: 2.1 })], { sec: 2 });
    expect(snapshotOf(later, 2_000, first).tags[0]).toBe(first.tags[0]);
    const read = stateFrame([wireTag({ readings: readings({ co2: 1 }) })], { sec: 2 });
    expect(snapshotOf(read, 2_000, first).tags[0]).not.toBe(first.tags[0]);
  });

  test('a tag’s ranges are those of the last sure species, as the bridge has them', () => {
    const wire = wireTag({ species: 'rose', species_confidence: 0.3 });
    const first = snapshotOf(stateFrame([wire]), 0, null);
    expect(first.tags[0]?.sureSpecies).toBe('');
    const one = { verdict: 'healthy', reasons: [], species: 'lupin' } as const;
    const judged = stateFrame([wire], {
      sec: 106,
      health: { ...NOBODY, tags: { [wire.tag_id]: one } },
    });
    const [tag] = snapshotOf(judged, 0, first).tags;
    expect([tag?.sureSpecies, tag?.species]).toEqual(['lupin', 'rose']);
  });

  test('a tag whose age becomes known is another, also without a reading', () => {
    const first = snapshotOf(stateFrame([wireTag({ stale_seconds: null })], { sec: 1 }), 0, null);
    const later = snapshotOf(stateFrame([wireTag({ stale_seconds: 2 })], { sec: 2 }), 1_000, first);
    expect([first.tags[0]?.isObserved, later.tags[0]?.isObserved]).toEqual([false, true]);
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

describe('times of their own', () => {
  const unknown = { name: 'a', value: 1, observed_at: null };

  test('each reading has its own, and the newest is that of the scan', () => {
    const both = [...readings({ a: 1 }, 4_940), ...readings({ b: 1 }, 4_970)];
    const { readAt, scannedAt } = tagOf(wireTag({ readings: both }));
    expect([...readAt]).toEqual([
      ['a', 4_940],
      ['b', 4_970],
    ]);
    expect(scannedAt).toBe(4_970);
  });

  test('what the twin does not report is unknown, and never fresh', () => {
    const scanned = (list: TwinTagState['readings'], age: number | null = 1): unknown =>
      tagOf(wireTag({ readings: list, stale_seconds: age })).scannedAt;
    expect(scanned([unknown])).toBe('unknown');
    expect(scanned([unknown, ...readings({ b: 1 }, 4_997)])).toBe(4_997);
    expect(scanned([])).toBe('never');
    // If the clock does not run, no age is known.
    expect(scanned(readings({ b: 1 }, 4_997), null)).toBe('unknown');
  });

  test('inspection and attempt have their own times; a success has no failed attempt', () => {
    const wire = wireTag({
      looked_at: 4_990.5,
      last_try: 4_880,
      last_try_status: 2,
      last_try_detail: 'dark',
    });
    const tag = tagOf(wire);
    expect(tag.inspectedAt).toBe(4_990.5);
    expect(tag.failedAttempt).toEqual({ at: 4_880, status: 2, detail: 'dark' });
    expect(tagOf({ ...wire, last_try_status: 0 }).failedAttempt).toBeNull();
  });

  test('a tag of which nothing but its ages went on is the very same', () => {
    const house = (own: TwinTagState['readings'], sec: number): Latest =>
      stateFrame([wireTag({ stale_seconds: sec - 900, readings: own })], { sec });
    const own = readings({ a: 1 }, 935);
    const first = snapshotOf(house(own, 1_000), 0, null);
    const later = snapshotOf(house(structuredClone(own), 1_010), 10_000, first);
    expect(later.tags[0]).toBe(first.tags[0]);
    // A light scan with the same value by chance.
    const again = snapshotOf(house(readings({ a: 1 }, 1_020), 1_020), 20_000, later);
    expect(again.tags[0]?.readAt.get('a')).toBe(1_020);
    // A twin that stops reporting it.
    const silent = snapshotOf(house([unknown], 1_030), 30_000, again);
    expect(silent.tags[0]?.scannedAt).toBe('unknown');
  });
});

describe('a tag that is far off', () => {
  const at = (id: string, x: number): TwinTagState => {
    const { pose } = wireTag();
    return wireTag({ tag_id: id, pose: { ...pose, position: { x, y: 0, z: 0 } } });
  };
  const wire = [at('1', 0), at('2', 1), at('3', 2), at('lost', 5000)];
  const first = snapshotOf(stateFrame(wire, { sec: 5 }), 1000, null);

  test('has no place on the map, but its position', () => {
    expect(first.tags.map((tag) => tag.at?.x)).toEqual([0, 1, 2, undefined]);
    expect(first.tags.map((tag) => tag.farOff?.x)).toEqual([undefined, undefined, undefined, 5000]);
  });

  test('is the very same tag as long as nothing but the time goes on', () => {
    expect(snapshotOf(stateFrame(wire, { sec: 6 }), 2000, first).tags).toBe(first.tags);
  });

  test('is back on the map with as many others there', () => {
    const more = [...wire, at('5', 5001), at('6', 5002)];
    const next = snapshotOf(stateFrame(more, { sec: 6 }), 2000, first);
    expect(next.tags.map((tag) => tag.at?.x)).toEqual([0, 1, 2, 5001, 5002, 5000]);
  });
});

describe('the cases of the twin’s own tests', () => {
  test.each(Object.entries(cases))('%s', (_, { at, far }) => {
    const places = at.map(([x, y]) => mapPoint(x ?? NaN, y ?? NaN));
    const reach = reachOf(places);
    const found = places.flatMap((place, index) => (holds(reach, place) ? [] : [index]));
    expect(found).toEqual(far);
  });
});
