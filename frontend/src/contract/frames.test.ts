import { describe, expect, test } from 'vitest';

import { alarm } from '../testing/alarms';
import { NOBODY } from '../testing/health';
import { readings, stateFrame, wireTag } from '../testing/tags';
import { MAX_ALARMS, MAX_FRAME_CHARS, MAX_TAGS, parseFrame } from './frames';
import { MAX_SENSORS } from './shapes';
import type { Frame } from './types';

const status = {
  type: 'status',
  twin: 'offline',
  reason: 'stale',
  message: '',
  state_age_seconds: 4,
  has_map: false,
  origin: 'robot',
  input_problems: ['nothing has come yet from /map'],
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
  expect(parse({ type: 'weather' })).toEqual({
    kind: 'passed over',
    message: { type: 'weather' },
  });
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
  ['null', 'frame: an object, not null'],
  ['7', 'frame: an object, not 7'],
  ['[]', 'frame: an object, not a list of 0'],
  ['{"type":"delta"}', 'delta.seq: is missing'],
  ['{"type":"state","seq":1,"revision":"r","state":null}', 'state.state: an object, not null'],
  ['{"type":"state","seq":1e999,"revision":"r"}', 'state.seq: a number, not Infinity'],
  [JSON.stringify({ ...status, twin: 'well' }), 'status.twin: one of live, offline, not "well"'],
])('%s: what is wrong is named', (data, why) => {
  expect(whyBad(data)).toBe(why);
});

test('a bad delta is known for one: what it would have changed is lost', () => {
  expect(parse({ ...delta, removed: null })).toMatchObject({ kind: 'bad', isDelta: true });
  expect(parse({ ...full, seq: null })).toMatchObject({ kind: 'bad', isDelta: false });
});

describe('what would stop the page is refused, at the limit and one past it', () => {
  const house = (count: number, over: object = {}): Frame =>
    stateFrame(
      Array.from({ length: count }, (_, index) => wireTag({ tag_id: `t${index}`, ...over })),
    );
  const kinds = (count: number): Record<string, number> =>
    Object.fromEntries(Array.from({ length: count }, (_, index) => [`s${index}`, 1]));

  test('tags', () => {
    // Short ones, as the text of so many is long.
    const tags = (count: number): string => `[${Array(count).fill('{}').join()}]`;
    const frame = (count: number): string =>
      `{"type":"state","seq":1,"revision":"r","state":{"header":${JSON.stringify(header)},"tags":${tags(count)}}}`;
    expect(whyBad(frame(MAX_TAGS))).toBe('state.state.tags[0].tag_id: is missing');
    expect(whyBad(frame(MAX_TAGS + 1))).toBe(
      `state.state.tags: ${MAX_TAGS + 1} entries, the limit is ${MAX_TAGS}`,
    );
  });

  test('kinds of sensors, of one tag and of all', () => {
    const one = (count: number): unknown => house(1, { readings: readings(kinds(count)) });
    expect(parse(one(MAX_SENSORS)).kind).toBe('frame');
    expect(parse(one(MAX_SENSORS + 1)).kind).toBe('bad');
    const half = readings(kinds(MAX_SENSORS));
    const two = stateFrame([
      wireTag({ tag_id: 'a', readings: half }),
      wireTag({ tag_id: 'b', readings: readings({ other: 1 }) }),
    ]);
    expect(whyBad(JSON.stringify(two))).toBe(
      `state.state.tags[1].readings: more than ${MAX_SENSORS} kinds of sensors`,
    );
  });

  test('characters', () => {
    expect(whyBad(' '.repeat(MAX_FRAME_CHARS + 1))).toMatch(/the limit is 128000000$/);
  });
});

test('drops are told, if they are well formed', () => {
  const drops = [{ reason: 'frame', message: 'frame odom', count: 12 }];
  expect(parse({ ...status, drops })).toMatchObject({ kind: 'frame', frame: { drops } });
  expect(whyBad(JSON.stringify({ ...status, drops: [{ ...drops[0], count: -1 }] }))).toBe(
    'status.drops[0].count: a whole number, not -1',
  );
});

test('a tag that is there twice is one too many', () => {
  expect(whyBad(JSON.stringify(stateFrame([wireTag(), wireTag()])))).toBe(
    'state.state.tags[1].tag_id: "1" a second time',
  );
});

describe('alarms', () => {
  const frame = (over: object = {}): object => ({
    type: 'alarms',
    alarms: [alarm('a'), alarm('b', { cleared: 950, worst: 2 })],
    source: 'journal',
    since: { sec: 1, nanosec: 0 },
    ...over,
  });

  test('are read, of a later server too', () => {
    expect(parse(frame())).toEqual({ kind: 'frame', frame: frame() });
    const later = frame({ source: 'archive', since: null, more: 1 });
    expect(parse(later)).toEqual({ kind: 'frame', frame: later });
  });

  test.each([
    [{ alarms: null }, /^alarms\.alarms: a list/],
    [{ alarms: [{ ...alarm('a'), id: 7 }] }, /^alarms\.alarms\[0\]\.id: text/],
    [{ alarms: [{ ...alarm('a'), reason: null }] }, /\[0\]\.reason: an object/],
    [{ alarms: [{ ...alarm('a'), tag_id: null }] }, /\[0\]\.tag_id: text/],
    [{ alarms: [{ ...alarm('a'), raised_at: null }] }, /\[0\]\.raised_at: an object/],
    [{ alarms: [{ ...alarm('a'), cleared_at: 7 }] }, /\[0\]\.cleared_at: an object/],
    [{ alarms: [{ ...alarm('a'), worst: '7' }] }, /\[0\]\.worst: a number or null/],
    [{ alarms: [alarm('a'), alarm('a')] }, /\[1\]\.id: "a" a second time/],
    [{ since: 'ever' }, /^alarms\.since: an object/],
  ])('%j is refused', (over, why) => {
    expect(whyBad(JSON.stringify(frame(over)))).toMatch(why);
  });

  test('no more than the limit', () => {
    const many = Array.from({ length: MAX_ALARMS + 1 }, (_, at) => alarm(String(at)));
    expect(parse(frame({ alarms: many.slice(1) })).kind).toBe('frame');
    expect(whyBad(JSON.stringify(frame({ alarms: many })))).toMatch(/the limit is 20000$/);
  });
});
