import { expect, test } from 'vitest';

import type { Timeline } from '../domain/timeline';
import { FakeContext } from '../testing/canvas';
import { timelineWith } from '../testing/timeline';
import { type Axis, columnsOf } from './axis';
import { BAR_PX, drawBar, type BarPalette } from './draw';

const AXIS: Axis = { from: 100, to: 200, width: 1_000 };
const PALETTE: BarPalette = {
  ink: 'ink',
  muted: 'muted',
  line: 'line',
  scan: 'scan',
  failure: 'failure',
  pest: 'pest',
  cleared: 'cleared',
  silence: 'silence',
  surface: 'surface',
  font: '11px sans-serif',
};
const NOTHING = { scans: 0, failures: 0, looks: 0, pests_seen: 0, pests_cleared: 0 };

const drawn = (
  over: Partial<Timeline>,
  ticks = [{ at: 150, text: '12:30\n14 Nov' }],
): FakeContext => {
  const timeline = timelineWith(over);
  const fake = new FakeContext();
  const surface = { context: fake.asContext(), size: { width: 1_000, height: BAR_PX }, ratio: 1 };
  drawBar(surface, { axis: AXIS, timeline, columns: columnsOf(timeline, AXIS), ticks }, PALETTE);
  return fake;
};

test('scans stand upwards and failures hang downwards, from one line', () => {
  const fills = drawn({ buckets: [{ ...NOTHING, start: 150, scans: 9, failures: 4 }] })
    .named('fillRect')
    .map(({ args, state }) => [state['fillStyle'], args[1], args[3]]);
  const [scan, failure] = fills;
  expect(scan?.[0]).toBe('scan');
  expect(failure?.[0]).toBe('failure');
  expect(Number(scan?.[1]) + Number(scan?.[2])).toBe(38);
  expect(failure?.[1]).toBe(39);
});

test('a pest is a full triangle, one that is gone an empty ring; who needs somebody is on top', () => {
  const seen = drawn({ buckets: [{ ...NOTHING, start: 150, pests_seen: 1, pests_cleared: 1 }] });
  expect(seen.named('fill').map(({ state }) => state['fillStyle'])).toEqual(['pest']);
  expect(seen.named('arc')).toEqual([]);
  const cleared = drawn({ buckets: [{ ...NOTHING, start: 150, pests_cleared: 1 }] });
  expect(cleared.named('arc')).toHaveLength(1);
  expect(cleared.named('fill').map(({ state }) => state['fillStyle'])).toEqual(['surface']);
  // Beside it without room, before it or behind.
  const close = [
    { ...NOTHING, start: 149.4, pests_cleared: 1 },
    { ...NOTHING, start: 150, pests_seen: 1 },
    { ...NOTHING, start: 150.5, pests_seen: 1 },
    { ...NOTHING, start: 152, pests_cleared: 1 },
  ];
  const marks = drawn({ bucketS: 0.1, buckets: close }).named('fill');
  expect(marks.map(({ state }) => state['fillStyle'])).toEqual(['pest', 'surface']);
});

test('silence and what is not remembered lean to different sides', () => {
  const slants = (fake: FakeContext, colour: string): Set<number> =>
    new Set(
      fake
        .named('moveTo')
        .filter(({ state }) => state['strokeStyle'] === colour && state['lineWidth'] === 1.5)
        .map(({ args }) => Number(args[1])),
    );
  const fake = drawn({ silences: [{ from: 120, to: 130 }], reach: { from: 110, to: 200 } });
  const [silence, before] = [slants(fake, 'silence'), slants(fake, 'line')];
  expect([silence.size, before.size]).toEqual([1, 1]);
  expect([...silence][0]).not.toBe([...before][0]);
});

test('what is no longer kept, or was not recorded, is hatched as what is not remembered', () => {
  const lines = (missing: Timeline['missing']): unknown[] =>
    drawn({ missing }, [])
      .named('rect')
      .map(({ args }) => [args[0], args[2]]);
  expect(lines([])).toEqual([]);
  expect(
    lines([
      { from: 100, to: 120, why: 'not_kept' },
      { from: 190, to: 200, why: 'not_recorded' },
    ]),
  ).toEqual([
    [0, 200],
    [900, 100],
  ]);
});

test('a clock that began anew is a dashed line', () => {
  const run = { isSimulated: true };
  const runs = [
    { ...run, from: 100, to: 150 },
    { ...run, from: 150, to: 200 },
  ];
  expect(drawn({ runs }).named('setLineDash')).toHaveLength(1);
  expect(drawn({}).named('setLineDash')).toHaveLength(0);
});

test('times stand beside their dates, and never upon each other', () => {
  const texts = drawn({}, [
    { at: 101, text: '12:00\n14 Nov' },
    { at: 102, text: '12:01' },
    { at: 150, text: '13:00' },
  ]).named('fillText');
  expect(texts.map(({ args }) => args[0])).toEqual(['14 Nov 12:00', '13:00']);
});

test('before anything has come there is the axis alone', () => {
  const fake = new FakeContext();
  const surface = { context: fake.asContext(), size: { width: 1_000, height: BAR_PX }, ratio: 1 };
  drawBar(surface, { axis: AXIS, timeline: null, columns: [], ticks: [] }, PALETTE);
  expect(fake.named('fillRect')).toEqual([]);
  expect(fake.named('stroke')).toHaveLength(1);
});
