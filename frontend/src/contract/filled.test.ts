import { expect, test, vi } from 'vitest';

import { judgement, NOBODY, reason } from '../testing/health';
import { stateFrame, wireTag } from '../testing/tags';
import { parseFrame } from './frames';
import { fetchStateAt } from './past';

const sec = (sec: number): { sec: number; nanosec: number } => ({ sec, nanosec: 0 });

/** As the server writes it: without what is as usual. */
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
const reading = (name: string, value: number, at: number | null, stale: number | null): object => ({
  name,
  value,
  observed_at: at === null ? null : sec(at),
  stale_seconds: stale,
});
const filled = [
  wireTag({
    tag_id: 'a',
    last_observed: sec(100),
    stale_seconds: 5,
    last_try: sec(100),
    last_try_status: 0,
    readings: [
      reading('co2', 1, 100, 5),
      reading('light', 2, 40, 65),
      reading('ph', 3, 40, 65),
      reading('ec', 4, null, null),
      reading('vpd', 5, null, null),
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
  const told = await fetchStateAt(12, new AbortController().signal);
  expect(told).toMatchObject({ state: { tags: filled }, health: verdicts });
});

test('of a clock that does not run, no age is known', () => {
  const still = { ...tags[0], stale_seconds: null };
  const frame = { ...stateFrame([]), state: { ...stateFrame([]).state, tags: [still] } };
  const parsed = parseFrame(JSON.stringify(frame));
  expect(parsed).toMatchObject({
    frame: {
      state: { tags: [{ readings: tags[0]?.readings.map(() => ({ stale_seconds: null })) }] },
    },
  });
});
