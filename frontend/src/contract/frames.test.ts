import { describe, expect, test, vi } from 'vitest';

import { alarm } from '../testing/alarms';
import { judgement, NOBODY, reason } from '../testing/health';
import { readings, stateFrame, wireTag } from '../testing/tags';
import { latestAfter, parseFrame } from './frames';
import { fetchStateAt } from './past';
import type { DeltaFrame } from './types';

const status = {
  type: 'status',
  twin: 'offline',
  reason: 'stale',
  message: '',
  state_age_seconds: 4,
  has_map: false,
  origin: 'robot',
  twin_count: 1,
  input_problems: ['nothing has come yet from /map'],
  day_length_s: 86_400,
  drops: [{ reason: 'frame', message: 'dropped a message', count: 3 }],
  journal: {
    state: 'failing',
    detail: 'no room',
    set_aside: '',
    simulated: { start: 1, end: 2 },
  },
  outward: [{ channel: 'mqtt', is_failing: true, detail: 'refused' }],
};
const header = { stamp: 1, frame_id: 'map' };
const bad = {
  kind: 'range',
  verdict: 'critical',
  sensor: 'temperature',
  value: 6.6,
  limit: 10,
  since: 1,
};
const health = { ...NOBODY, tags: { a: { verdict: 'critical', reasons: [bad] } } } as const;
const delta = {
  type: 'delta',
  seq: 2,
  base: 1,
  revision: 'r',
  header,
  changed: [],
  removed: [],
  health,
};
const bloom = {
  position: { x: 1, y: null, z: 0 },
  height_m: 0.2,
  species: 'rose',
  confidence: null,
  anomaly: false,
};
const full = {
  ...stateFrame([
    wireTag({ readings: readings({ temperature: 20, co2: null }), flowers: [bloom] }),
  ]),
  health,
};

const parse = (message: unknown): ReturnType<typeof parseFrame> =>
  parseFrame(JSON.stringify(message));
const alarms = { type: 'alarms', alarms: [alarm('a')], source: 'journal', since: null, notes: 0 };

test.each([
  [full],
  [status],
  [alarms],
  [delta],
  [{ ...delta, changed: full.state.tags, removed: ['x'] }],
])('reads a frame of the contract, %#', (frame) => {
  expect(parse(frame)).toEqual(frame);
});

test('a stamp of the wire becomes seconds, tags with the names of its parts stay', () => {
  const tags = { sec: health.house, nanosec: health.house };
  const wire = { ...delta, tags, header: { ...header, stamp: { sec: 12, nanosec: 250_000_000 } } };
  const frame = { ...delta, tags, header: { ...header, stamp: 12.25 } };
  expect(parse(wire)).toEqual(frame);
});

test('fields and reasons of a later server do no harm', () => {
  const later = { ...status, reason: 'on_holiday', more: [[[[]]]] };
  expect(parse(later)).toEqual(later);
  expect(parse({ type: 'weather' })).toBeNull();
  // Not a frame's name, though a property of every object.
  expect(parse({ type: 'constructor' })).toBeNull();
});

test.each([
  ['no json'],
  ['{"type":"state","seq":1'],
  ['null'],
  ['{"type":"delta"}'],
  [new ArrayBuffer(2)],
])('%s is no frame', (data) => {
  expect(() => parseFrame(data)).toThrow();
});

describe('filled', () => {
  /** As the server writes it: without defaults. */
  const tags = [
    {
      ...wireTag({ tag_id: 'a', last_observed: 100, stale_seconds: 5 }),
      readings: [
        { name: 'co2', value: 1 },
        { name: 'light', value: 2, observed_at: 40 },
        { name: 'ph', value: 3 },
        { name: 'ec', value: 4, observed_at: null },
        { name: 'vpd', value: 5 },
      ],
      looked_at: undefined,
      last_try: undefined,
      last_try_status: undefined,
      last_try_detail: undefined,
      derived: { dew_point: 14 },
      derived_at: 40,
    },
    {
      ...wireTag({ tag_id: 'b', last_observed: 0, stale_seconds: null }),
      readings: [{ name: 'co2', value: 1, observed_at: 3 }],
      derived: { dew_point: 15 },
    },
  ];
  const health = {
    house: { ...NOBODY.house, reasons: undefined },
    tags: { a: { verdict: 'healthy' }, b: { verdict: 'critical', reasons: [reason()] } },
  };
  const reading = (name: string, value: number, at: number | null): object => ({
    name,
    value,
    observed_at: at,
  });
  const filled = [
    wireTag({
      tag_id: 'a',
      last_observed: 100,
      stale_seconds: 5,
      last_try: 100,
      last_try_status: 0,
      readings: [
        reading('co2', 1, 100),
        reading('light', 2, 40),
        reading('ph', 3, 40),
        reading('ec', 4, null),
        reading('vpd', 5, null),
        reading('dew_point', 14, 40),
      ] as never,
    }),
    wireTag({
      tag_id: 'b',
      last_observed: 0,
      stale_seconds: null,
      readings: [reading('co2', 1, 3), reading('dew_point', 15, 3)] as never,
    }),
  ];
  const said = judgement({ a: 'healthy', b: [reason()] });
  const verdicts = { house: NOBODY.house, tags: said.tags };

  test.each([
    [
      { ...stateFrame([]), state: { ...stateFrame([]).state, tags }, health },
      { state: { tags: filled }, health: verdicts },
    ],
    [
      {
        ...{ type: 'delta', seq: 2, base: 1, revision: 'r', removed: [], changed: tags, health },
        header: stateFrame([]).state.header,
      },
      { changed: filled, health: verdicts },
    ],
  ])('what a frame leaves out is put back, %#', (frame, expected) => {
    expect(parseFrame(JSON.stringify(frame))).toMatchObject(expected);
  });

  test('and what a state of the past does', async () => {
    const state = { ...stateFrame([], { sec: 12 }).state, tags };
    vi.stubGlobal('fetch', (url: URL) =>
      Promise.resolve(Response.json(url.pathname === '/api/health' ? health : state)),
    );
    const received = await fetchStateAt(12, new AbortController().signal);
    expect(received).toMatchObject({ state: { tags: filled }, health: verdicts });
  });
});

describe('latest', () => {
  const a = wireTag({
    tag_id: 'a',
    last_observed: 995,
    readings: [
      // Flowers were inspected since.
      { name: 'co2', value: 600, observed_at: 100 },
      // A twin that does not report it.
      { name: 'light', value: 9, observed_at: null },
    ],
  });
  const b = wireTag({ tag_id: 'b', stale_seconds: null, last_observed: 0 });
  const full = stateFrame([a, b], { seq: 7, sec: 1000 });

  const delta = (over: Partial<DeltaFrame> = {}): DeltaFrame => ({
    type: 'delta',
    seq: 8,
    base: 7,
    revision: 'r2',
    header: { stamp: 1002.5, frame_id: 'map' },
    changed: [],
    removed: [],
    health: NOBODY,
    ...over,
  });

  describe('the newest state', () => {
    test('a full frame stands for itself, whatever was before', () => {
      expect(latestAfter(null, full)).toBe(full);
      expect(latestAfter({ ...full, seq: 900 }, full)).toBe(full);
    });

    test('changed tags take their place, new ones come behind, removed ones go', () => {
      const changed = [wireTag({ tag_id: 'b', species: 'rose' }), wireTag({ tag_id: 'c' })];
      const after = latestAfter(full, delta({ changed, removed: ['a'] }));
      expect(after?.state.tags).toEqual(changed);
      expect(after).toMatchObject({ seq: 8, revision: 'r2' });
    });

    test('an unchanged tag is the very same', () => {
      const after = latestAfter(full, delta());
      expect(after?.state.tags[0]).toBe(a);
      expect(after?.state.header.stamp).toBe(1002.5);
    });

    test('a delta on another frame, or on none, cannot be used', () => {
      expect(latestAfter(full, delta({ base: 6 }))).toBeNull();
      expect(latestAfter(null, delta())).toBeNull();
    });
  });

  test('the health of who has changed is another, and of who is gone none', () => {
    const critical = { verdict: 'critical', reasons: [] } as const;
    const healthy = { verdict: 'healthy', reasons: [] } as const;
    const known = { ...full, health: { ...NOBODY, tags: { a: healthy, b: critical } } };
    const same = latestAfter(known, delta());
    expect(same?.health.tags).toBe(known.health.tags);
    const house = { ...NOBODY.house, verdict: 'critical' } as const;
    const then = latestAfter(
      known,
      delta({ removed: ['b'], health: { house, tags: { a: critical } } }),
    );
    expect(then?.health).toEqual({ house, tags: { a: critical } });
  });
});
