import { describe, expect, test } from 'vitest';

import { alarm } from '../testing/alarms';
import { NOBODY } from '../testing/health';
import { readings, stateFrame, wireTag } from '../testing/tags';
import { MAX_FRAME_CHARS, parseFrame } from './frames';

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
const reason = {
  kind: 'range',
  verdict: 'critical',
  sensor: 'temperature',
  value: 6.6,
  limit: 10,
  since: { sec: 1, nanosec: 0 },
};
const health = { ...NOBODY, tags: { a: { verdict: 'critical', reasons: [reason] } } } as const;
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
  // No frame's name, though every object has it.
  expect(parse({ type: 'constructor' })).toMatchObject({ kind: 'passed over' });
});

/** Every field of a frame that holds one, as a path, and the frame with it set to something. */
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

/** What `filled.ts` makes, whatever is sent. */
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

  test.each([
    [{ alarms: null }, /^alarms\.alarms: a list/],
    [{ alarms: [{ ...alarm('a'), id: 7 }] }, /^alarms\.alarms\[0\]\.id: a value of type string/],
    [{ alarms: [{ ...alarm('a'), reason: null }] }, /\[0\]\.reason: an object/],
    [{ alarms: [{ ...alarm('a'), tag_id: null }] }, /\[0\]\.tag_id: a value of type string/],
    [{ alarms: [{ ...alarm('a'), raised_at: null }] }, /\[0\]\.raised_at: an object/],
    [{ alarms: [{ ...alarm('a'), cleared_at: 7 }] }, /\[0\]\.cleared_at: an object/],
    [{ alarms: [{ ...alarm('a'), worst: '7' }] }, /\[0\]\.worst: a value of type number/],
    [{ since: 'ever' }, /^alarms\.since: an object/],
  ])('%j is refused', (over, why) => {
    expect(whyBad(JSON.stringify(frame(over)))).toMatch(why);
  });
});

test.each([
  [{ position: { x: '2' } }, 'robot.position.x'],
  [{ position: null, plan: { points: 'far' } }, 'robot.plan.points'],
  [{ plan: null }, 'robot.position: is missing'],
])('a robot’s frame of %j is refused', (parts, why) => {
  expect(whyBad(JSON.stringify({ type: 'robot', ...parts }))).toContain(why);
});
