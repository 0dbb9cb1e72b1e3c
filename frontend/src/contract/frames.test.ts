import { describe, expect, test, vi } from 'vitest';

import { alarm } from '../testing/alarms';
import { judgement, NOBODY, reason } from '../testing/health';
import { readings, stateFrame, wireTag } from '../testing/tags';
import { latestAfter, MAX_FRAME_CHARS, parseFrame } from './frames';
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
    simulated: { start: { sec: 1, nanosec: 0 }, end: { sec: 2, nanosec: 0 } },
  },
  outward: [{ channel: 'mqtt', is_failing: true, detail: 'refused' }],
};
const header = { stamp: { sec: 1, nanosec: 0 }, frame_id: 'map' };
const bad = {
  kind: 'range',
  verdict: 'critical',
  sensor: 'temperature',
  value: 6.6,
  limit: 10,
  since: { sec: 1, nanosec: 0 },
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
const whyBad = (data: unknown): string => {
  const parsed = parseFrame(data);
  return parsed.kind === 'bad' ? parsed.why : `not bad but ${parsed.kind}`;
};

test.each([[full], [status], [delta], [{ ...delta, changed: full.state.tags, removed: ['x'] }]])(
  'reads a frame of the contract, %#',
  (frame) => {
    expect(parse(frame)).toEqual({ kind: 'frame', frame });
  },
);

test('fields and reasons of a later server do no harm', () => {
  const later = { ...status, reason: 'on_holiday', more: [[[[]]]] };
  expect(parse(later)).toEqual({ kind: 'frame', frame: later });
  expect(parse({ type: 'weather' })).toEqual({ kind: 'passed over' });
  // Not a frame's name, though a property of every object.
  expect(parse({ type: 'constructor' })).toMatchObject({ kind: 'passed over' });
});

/** The path of every field, and the frame with `wrong` in its place. */
function mutations(frame: unknown, wrong: unknown): [string, unknown][] {
  if (typeof frame !== 'object' || frame === null) return [];
  return Object.entries(frame).flatMap(([key, value]: [string, unknown]) => {
    const put = (next: unknown): unknown =>
      Array.isArray(frame)
        ? frame.map((each: unknown, index) => (String(index) === key ? next : each))
        : { ...frame, [key]: next };
    const deeper = mutations(value, wrong).map(([path, next]): [string, unknown] => [
      `.${key}${path}`,
      put(next),
    ]);
    return [[`.${key}`, put(wrong)] as [string, unknown], ...deeper];
  });
}

/** Fields that the page computes itself, whatever is sent. */
const OF_THE_PAGE = /\.readings\.\d+\.stale_seconds$/;

const paths = (frame: unknown): string[] => mutations(frame, undefined).map(([path]) => path);

describe('each field is checked', () => {
  test.each([
    ['a truth', true, /\.(anomaly|has_map|is_day|is_failing)$/],
    [
      'a list',
      [],
      /\.(state\.tags|readings|flowers|points|changed|removed|input_problems|drops|reasons|outward)$/,
    ],
    ['an object', {}, /\.health\.tags$/],
    [
      'a number as text',
      '21.5',
      /\.(type|revision|frame_id|tag_id|species|name|reason|message|last_try_detail|kind|sensor|source|state|detail|set_aside|channel|origin|input_problems\.0)$/,
    ],
    [
      'nothing',
      undefined,
      /\.(health\.tags\.a|reasons|observed_at|looked_at|last_try|last_try_status|last_try_detail)$/,
    ],
  ])('for %s in its place', (_, wrong, mayPass) => {
    for (const frame of [full, { ...delta, changed: full.state.tags, removed: ['x'] }, status]) {
      for (const [path, broken] of mutations(frame, wrong)) {
        if (path === '.type' || mayPass.test(path) || path.endsWith('.removed.0')) continue;
        if (OF_THE_PAGE.test(path)) continue;
        expect(parse(broken).kind, path).toBe('bad');
      }
    }
  });

  test('null is no value but where one may be unknown', () => {
    const nullable =
      /\.(value|observed_at|stale_seconds|species_confidence|confidence|height_m|x|y|z|w|state_age_seconds|looked_at|last_try|last_try_status|limit|since|simulated|interval_s|last_scan)$/;
    expect(paths(full).some((path) => nullable.test(path))).toBe(true);
    for (const frame of [full, status]) {
      for (const [path, broken] of mutations(frame, null)) {
        expect(parse(broken).kind, path).toBe(nullable.test(path) ? 'frame' : 'bad');
      }
    }
  });
});

test.each([
  ['no json', 'a message that is no JSON'],
  ['{"type":"state","seq":1', 'a message that is no JSON'],
  [new ArrayBuffer(2), 'a message that is no text'],
  ['null', 'a frame without type'],
  ['7', 'a frame without type'],
  ['[]', 'a frame without type'],
  ['{"type":"delta"}', 'delta.seq: is missing'],
  ['{"type":"state","seq":1,"revision":"r","state":null}', 'state.state: an object, not null'],
  [
    '{"type":"state","seq":1e999,"revision":"r"}',
    'state.seq: a value of type integer, not Infinity',
  ],
  [JSON.stringify({ ...status, twin: 'well' }), 'status.twin: live,offline, not "well"'],
])('%s: what is wrong is named', (data, why) => {
  expect(whyBad(data)).toBe(why);
});

test('a bad delta is known for one: what it would have changed is lost', () => {
  expect(parse({ ...delta, removed: null })).toMatchObject({ kind: 'bad', isDelta: true });
  expect(parse({ ...full, seq: null })).toMatchObject({ kind: 'bad', isDelta: false });
});

test('a frame of too many characters is refused', () => {
  expect(whyBad(' '.repeat(MAX_FRAME_CHARS + 1))).toMatch(/the limit is 128000000$/);
});

describe('alarms', () => {
  const frame = (over: object = {}): object => ({
    type: 'alarms',
    alarms: [alarm('a'), alarm('b', { cleared: 950, worst: 2 })],
    source: 'journal',
    since: { sec: 1, nanosec: 0 },
    notes: 0,
    ...over,
  });

  test('are read, of a later server too', () => {
    expect(parse(frame())).toEqual({ kind: 'frame', frame: frame() });
    const later = frame({ source: 'archive', since: null, more: 1 });
    expect(parse(later)).toEqual({ kind: 'frame', frame: later });
  });

  test('are checked to the last field', () => {
    const bad = frame({ alarms: [{ ...alarm('a'), cleared_at: 7 }] });
    expect(whyBad(JSON.stringify(bad))).toMatch(/^alarms\.alarms\[0\]\.cleared_at: an object/);
  });
});

test.each([
  [{ position: { x: '2' } }, 'robot.position.x'],
  [{ position: null, plan: { points: 'far' } }, 'robot.plan.points'],
  [{ plan: null }, 'robot.position: is missing'],
])('a robot’s frame of %j is refused', (parts, why) => {
  expect(whyBad(JSON.stringify({ type: 'robot', ...parts }))).toContain(why);
});

describe('filled', () => {
  const sec = (sec: number): { sec: number; nanosec: number } => ({ sec, nanosec: 0 });

  /** As the server writes it: without defaults. */
  const tags = [
    {
      ...wireTag({ tag_id: 'a', last_observed: sec(100), stale_seconds: 5 }),
      readings: [
        { name: 'co2', value: 1 },
        { name: 'light', value: 2, observed_at: sec(40) },
        { name: 'ph', value: 3 },
        { name: 'ec', value: 4, observed_at: null },
        { name: 'vpd', value: 5 },
      ],
      looked_at: undefined,
      last_try: undefined,
      last_try_status: undefined,
      last_try_detail: undefined,
    },
    wireTag({ tag_id: 'b', last_observed: sec(0), stale_seconds: null }),
  ];
  const health = {
    house: { ...NOBODY.house, reasons: undefined },
    tags: { a: { verdict: 'healthy' }, b: { verdict: 'critical', reasons: [reason()] } },
  };
  const reading = (name: string, value: number, at: number | null): object => ({
    name,
    value,
    observed_at: at === null ? null : sec(at),
  });
  const filled = [
    wireTag({
      tag_id: 'a',
      last_observed: sec(100),
      stale_seconds: 5,
      last_try: sec(100),
      last_try_status: 0,
      readings: [
        reading('co2', 1, 100),
        reading('light', 2, 40),
        reading('ph', 3, 40),
        reading('ec', 4, null),
        reading('vpd', 5, null),
      ] as never,
    }),
    tags[1],
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
    expect(parseFrame(JSON.stringify(frame))).toMatchObject({ kind: 'frame', frame: expected });
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
    last_observed: { sec: 995, nanosec: 0 },
    readings: [
      // Flowers were inspected since.
      { name: 'co2', value: 600, observed_at: { sec: 100, nanosec: 0 } },
      // A twin that does not report it.
      { name: 'light', value: 9, observed_at: null },
    ],
  });
  const b = wireTag({ tag_id: 'b', stale_seconds: null, last_observed: { sec: 0, nanosec: 0 } });
  const full = stateFrame([a, b], { seq: 7, sec: 1000 });

  const delta = (over: Partial<DeltaFrame> = {}): DeltaFrame => ({
    type: 'delta',
    seq: 8,
    base: 7,
    revision: 'r2',
    header: { stamp: { sec: 1002, nanosec: 500_000_000 }, frame_id: 'map' },
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
      expect(after?.state.header.stamp.sec).toBe(1002);
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
