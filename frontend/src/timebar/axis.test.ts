import { describe, expect, test } from 'vitest';

import type { Timeline } from '../domain/timeline';
import { timelineWith } from '../testing/timeline';
import {
  type Axis,
  chosenAt,
  columnAt,
  columnsOf,
  momentAt,
  pixelS,
  runStarts,
  stepped,
  stretchesOf,
  xOf,
} from './axis';

const AXIS: Axis = { from: 1_000, to: 2_000, width: 500 };

test('there and back', () => {
  expect(xOf(AXIS, 1_500)).toBe(250);
  expect(momentAt(AXIS, 250)).toBe(1_500);
  expect(momentAt(AXIS, -3)).toBe(1_000);
  expect(momentAt(AXIS, 503)).toBe(2_000);
  expect(pixelS(AXIS)).toBe(2);
});

test('a bar that has no width yet divides by nothing', () => {
  const flat = { ...AXIS, width: 0 };
  expect(momentAt(flat, 5)).toBe(1_000);
  expect(pixelS(flat)).toBe(1_000);
});

test('the end of a bar that ends now is now, six pixels wide', () => {
  expect(chosenAt(AXIS, 493, 2_000)).toBe(1_986);
  expect(chosenAt(AXIS, 494, 2_000)).toBeNull();
  // The last bucket reaches slightly beyond now.
  expect(chosenAt(AXIS, 480, 1_960)).toBeNull();
  expect(chosenAt(AXIS, 499, 1_960)).toBeNull();
});

test('the end of a bar that has long been over is a moment like any other', () => {
  expect(chosenAt(AXIS, 500, 9_000)).toBe(2_000);
});

test('a step goes from where it stands, ends at now, and does not leave the bar backwards', () => {
  expect(stepped(AXIS, 1_500, -2, 2_000)).toBe(1_498);
  expect(stepped(AXIS, null, -2, 1_999)).toBe(1_997);
  expect(stepped(AXIS, 1_998, 2, 2_000)).toBeNull();
  expect(stepped(AXIS, 1_001, -20, 2_000)).toBe(1_000);
  // A link's moment may lie before the bar; a step forward is allowed, back is not.
  expect(stepped(AXIS, 400, 10, 2_000)).toBe(410);
  expect(stepped(AXIS, 400, -10, 2_000)).toBe(400);
});

describe('columns', () => {
  const AXIS: Axis = { from: 100, to: 200, width: 1_000 };

  const bucket = (
    start: number,
    over: Partial<Timeline['buckets'][number]> = {},
  ): Timeline['buckets'][number] => ({
    start,
    scans: 0,
    failures: 0,
    looks: 0,
    pests_seen: 0,
    pests_cleared: 0,
    ...over,
  });

  test('a wide bucket is a column of its own', () => {
    const [first, second] = columnsOf(
      timelineWith({
        buckets: [bucket(100, { scans: 4 }), bucket(150, { scans: 16, failures: 1 })],
      }),
      AXIS,
    );
    expect(first).toMatchObject({ x: 0, width: 10, start: 100, end: 101, scanHeight: 0.5 });
    expect(second).toMatchObject({ x: 500, scanHeight: 1, failureHeight: 0.25 });
  });

  test('one scan beside ten thousand can still be seen', () => {
    const [one] = columnsOf(
      timelineWith({ buckets: [bucket(100, { scans: 1 }), bucket(150, { scans: 10_000 })] }),
      AXIS,
    );
    expect(one?.scanHeight).toBe(0.1);
  });

  test('buckets beyond the bar are not on it', () => {
    const buckets = [bucket(99, { scans: 1 }), bucket(100), bucket(199), bucket(200)];
    expect(columnsOf(timelineWith({ buckets }), AXIS).map(({ start }) => start)).toEqual([
      100, 199,
    ]);
  });

  test('stretches are cut at the ends of the bar, and never too thin to be seen', () => {
    expect(
      stretchesOf(
        [
          { from: 0, to: 100 },
          { from: 90, to: 110 },
          { from: 150, to: 150.001 },
          { from: 195, to: 300 },
          { from: 200, to: 300 },
        ],
        AXIS,
      ),
    ).toEqual([
      { x: 0, width: 100 },
      { x: 500, width: 1 },
      { x: 950, width: 50 },
    ]);
  });

  test('a clock that began anew is marked; the first beginning is none', () => {
    const runs = [
      { from: 100.5, to: 140, is_simulated: true },
      { from: 150, to: 200, is_simulated: true },
    ];
    expect(runStarts(timelineWith({ runs }), AXIS)).toEqual([500]);
  });

  test('the column under a point', () => {
    const columns = columnsOf(timelineWith({ buckets: [bucket(100), bucket(150)] }), AXIS);
    expect(columnAt(columns, 9.9)?.start).toBe(100);
    expect(columnAt(columns, 10)).toBeUndefined();
  });

  test('no column goes on beyond the end of the bar', () => {
    const { from, to, width } = AXIS;
    const [last] = columnsOf(
      timelineWith({ buckets: [bucket(to - 1, { scans: 1 })], bucket_s: (to - from) / 4 }),
      AXIS,
    );
    expect(last?.end).toBe(to);
    expect((last?.x ?? 0) + (last?.width ?? 0)).toBeLessThanOrEqual(width + 1);
  });
});
