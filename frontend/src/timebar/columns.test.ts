import { expect, test } from 'vitest';

import type { Happened } from '../domain/timeline';
import { timelineWith } from '../testing/timeline';
import { type Axis, beforeMemory, columnAt, columnsOf, runStarts, stretchesOf } from './axis';

const AXIS: Axis = { from: 100, to: 200, width: 1_000 };

const bucket = (start: number, over: Partial<Happened> = {}): Happened => ({
  start,
  scans: 0,
  failures: 0,
  looks: 0,
  pestsSeen: 0,
  pestsCleared: 0,
  ...over,
});

test('a wide bucket is a column of its own', () => {
  const [first, second] = columnsOf(
    timelineWith({ buckets: [bucket(100, { scans: 4 }), bucket(150, { scans: 16, failures: 1 })] }),
    AXIS,
  );
  expect(first).toMatchObject({ x: 0, width: 10, start: 100, end: 101, scanHeight: 0.5 });
  expect(second).toMatchObject({ x: 500, scanHeight: 1, failureHeight: 0.25 });
});

test('narrow ones are added up until they can be told apart', () => {
  const narrow = { ...AXIS, width: 100 };
  const columns = columnsOf(
    timelineWith({
      buckets: [
        bucket(100, { scans: 1, pestsSeen: 1 }),
        bucket(102, { scans: 2, pestsCleared: 2, looks: 3 }),
        bucket(103, { scans: 5 }),
      ],
    }),
    narrow,
  );
  expect(columns).toHaveLength(2);
  expect(columns[0]).toMatchObject({ scans: 3, pestsSeen: 1, pestsCleared: 2, looks: 3, width: 3 });
  expect(columns[1]).toMatchObject({ scans: 5, x: 3 });
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
  expect(columnsOf(timelineWith({ buckets }), AXIS).map(({ start }) => start)).toEqual([100, 199]);
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
    { from: 100.5, to: 140, isSimulated: true },
    { from: 150, to: 200, isSimulated: true },
  ];
  expect(runStarts(timelineWith({ runs }), AXIS)).toEqual([500]);
});

test('what lies before memory is told, and a memory of nothing is all of it', () => {
  expect(beforeMemory(timelineWith({ reach: { from: 150, to: 200 } }), AXIS)).toEqual({
    x: 0,
    width: 500,
  });
  expect(beforeMemory(timelineWith({}), AXIS)).toBeNull();
  expect(beforeMemory(timelineWith({ reach: null }), AXIS)).toEqual({ x: 0, width: 1_000 });
});

test('the column under a point', () => {
  const columns = columnsOf(timelineWith({ buckets: [bucket(100), bucket(150)] }), AXIS);
  expect(columnAt(columns, 9.9)?.start).toBe(100);
  expect(columnAt(columns, 10)).toBeUndefined();
});

test('no column goes on beyond the end of the bar', () => {
  const { from, to, width } = AXIS;
  const [last] = columnsOf(
    timelineWith({ buckets: [bucket(to - 1, { scans: 1 })], bucketS: (to - from) / 4 }),
    AXIS,
  );
  expect(last?.end).toBe(to);
  expect((last?.x ?? 0) + (last?.width ?? 0)).toBeLessThanOrEqual(width + 1);
});
