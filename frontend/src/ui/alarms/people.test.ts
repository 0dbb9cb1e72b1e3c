import { afterEach, beforeEach, expect, test, vi } from 'vitest';

import { started } from '../../testing/life';
import { alarm, reportAlarms } from '../../testing/alarms';
import {
  acknowledgeAlarms,
  lastAction,
  NO_LOCAL_ALARMS,
  own,
  startOwn,
  undo,
  faultKey,
} from '../../alarms/own';
import { person } from '../../store/create';
import { SILENCE_MS } from '../../connection/machine';
import { goLive, goLost, status as bridgeStatus } from '../../testing/page';
import { toast } from '../toast';
import { merged, startPeople, sharingText, wordsFor } from './people';

const COLD = alarm('cold');
const STAMP = 1_000;
const SAID = { ...COLD, acknowledged_by: 'anna', acknowledged_at: STAMP };
const SHELVED = {
  ...COLD,
  ...{ shelved_by: 'bert', shelved_until: STAMP, shelved_reason: 'pipe under repair' },
};
const until = (): number => 60_000;

test('what somebody else acknowledged is acknowledged here, until it is withdrawn', () => {
  const first = merged(NO_LOCAL_ALARMS, [SAID], until);
  expect([...first.acknowledged.keys()]).toEqual(['cold']);
  expect(merged(first, [SAID], until)).toBe(first);
  expect(merged(first, [COLD], until).acknowledged.size).toBe(0);
});

test('a shelf is taken over with its reason, and goes with the word of who shelved', () => {
  const local = merged(NO_LOCAL_ALARMS, [SHELVED], until);
  expect(local.shelved.get(faultKey(COLD))).toMatchObject({
    until: 60_000,
    reason: 'pipe under repair',
  });
  expect(merged(local, [SHELVED], () => 61_000)).toBe(local);
  expect(merged(local, [COLD], until).shelved.size).toBe(0);
  // Also after an alarm that differs.
  const said = { ...SAID, id: 'other', tag_id: '2' };
  expect(merged(local, [said, COLD], until).shelved.size).toBe(0);
});

test('an operator at a bridge that writes no notes is not called a reader', () => {
  const anna = { can_sign_out: true, seconds_left: null, name: 'anna', can_write_notes: false };
  expect(sharingText({ ...anna, role: 'viewer' })).toContain('(viewer)');
  expect(sharingText({ ...anna, role: 'operator' })).toContain('this server stores no notes');
});

interface SentRequest {
  readonly method: string;
  readonly path: string;
  readonly body: unknown;
}

let requests: SentRequest[] = [];
let status = 201;
let isAway = false;
let role = 'operator';

beforeEach(() => {
  requests = [];
  status = 201;
  isAway = false;
  role = 'operator';
  own.set(NO_LOCAL_ALARMS);
  reportAlarms();
  const note = {
    ...{ id: 'n1', kind: 'acknowledge', subject: 'alarm:cold', text: '', until: null },
    ...{ made_at: 1, by: 'anna', withdrawn_by: null, withdrawn_at: null },
  };
  vi.stubGlobal('fetch', (url: URL, { method = 'GET', body }: RequestInit) => {
    const path = `${url.pathname}${url.search}`;
    requests.push({ method, path, body: typeof body === 'string' ? JSON.parse(body) : null });
    if (path === '/api/session') {
      if (isAway) return Promise.reject(new TypeError('Failed to fetch'));
      return Promise.resolve(
        Response.json({
          can_sign_out: true,
          seconds_left: null,
          name: 'anna',
          role,
          can_write_notes: role === 'operator',
        }),
      );
    }
    return Promise.resolve(Response.json(method === 'GET' ? { notes: [note] } : note, { status }));
  });
});

const stops: (() => void)[] = [];
afterEach(() => {
  for (const stop of stops.splice(0)) stop();
});

const signedIn = async (): Promise<void> => {
  stops.push(started(startPeople));
  await vi.waitFor(() => {
    expect(person.get()?.name).toBe('anna');
  });
  requests = [];
};

test('who has signed in is known also where the bridge was away at first', async () => {
  vi.useFakeTimers();
  isAway = true;
  stops.push(started(startPeople), () => vi.useRealTimers());
  await vi.advanceTimersByTimeAsync(100);
  expect(requests).toHaveLength(1);
  isAway = false;
  await vi.advanceTimersByTimeAsync(10_000);
  expect(person.get()?.name).toBe('anna');
});

test('what a viewer had acknowledged by themselves holds no more', async () => {
  person.set(null);
  acknowledgeAlarms([{ alarm: COLD }]);
  role = 'viewer';
  await signedIn();
  reportAlarms(COLD);
  expect(own.get().acknowledged.size).toBe(0);
  expect(requests).toEqual([]);
});

test('own actions are sent to the bridge, and withdrawn there', async () => {
  await signedIn();
  reportAlarms(COLD);
  acknowledgeAlarms([{ alarm: COLD }]);
  await vi.waitFor(() => {
    expect(requests).toEqual([
      { method: 'POST', path: '/api/notes', body: { kind: 'acknowledge', subject: 'alarm:cold' } },
    ]);
  });
  reportAlarms(SAID);
  undo();
  await vi.waitFor(() => {
    expect(requests.slice(1).map(({ method, path }) => `${method} ${path}`)).toEqual([
      'GET /api/notes?subject=alarm%3Acold',
      'DELETE /api/notes/n1',
    ]);
  });
});

test('an action can be undone until others act: what they have said stays', async () => {
  stops.push(started((on) => startOwn(localStorage, on)));
  await signedIn();
  const [same, other] = ['same', 'other'].map((id) => alarm(id, { tag_id: id }));
  if (!same || !other) throw new Error('two alarms');
  reportAlarms(COLD, same, other);
  acknowledgeAlarms([COLD, same].map((each) => ({ alarm: each })));
  await vi.waitFor(() => {
    expect(requests).toHaveLength(2);
  });
  const bert = { acknowledged_by: 'bert', acknowledged_at: STAMP };
  await vi.waitFor(() => {
    reportAlarms(SAID, { ...same, ...bert }, other);
    expect(lastAction.get()?.count).toBe(2);
  });
  reportAlarms(SAID, { ...same, ...bert }, { ...other, ...bert });
  undo();
  expect([...own.get().acknowledged.keys()]).toEqual(['cold', 'same', 'other']);
  expect(requests).toHaveLength(2);
});

test('what the bridge has taken holds here before the frame that says so', async () => {
  await signedIn();
  reportAlarms(COLD);
  let isAnswered = false;
  const said = fetch;
  vi.stubGlobal('fetch', async (...given: Parameters<typeof fetch>) => {
    const answer = await said(...given);
    isAnswered = true;
    return answer;
  });
  acknowledgeAlarms([{ alarm: COLD }]);
  await vi.waitFor(() => {
    expect(isAnswered).toBe(true);
  });
  // The answer's callbacks have run by the next event-loop turn.
  await new Promise((resolve) => setTimeout(resolve));
  expect(own.get().acknowledged.size).toBe(1);
  reportAlarms(COLD);
  expect(own.get().acknowledged.size).toBe(0);
});

test('what the bridge refuses does not hold here either', async () => {
  await signedIn();
  reportAlarms(COLD);
  status = 503;
  acknowledgeAlarms([{ alarm: COLD }]);
  await vi.waitFor(() => {
    expect(own.get().acknowledged.size).toBe(0);
  });
  expect(requests).toHaveLength(1);
  expect([lastAction.get(), toast.get()]).toEqual([null, expect.stringMatching(/^Not saved: /)]);
});

test.each([
  ['without a connection', goLost],
  [
    'where nothing comes any more',
    () => {
      goLive(bridgeStatus(), SILENCE_MS + 1);
    },
  ],
])('%s all are refused at once, as one is, and nothing looks done', async (_, lose) => {
  await signedIn();
  const other = alarm('other', { tag_id: '2' });
  reportAlarms(COLD, other);
  lose();
  acknowledgeAlarms([COLD, other].map((each) => ({ alarm: each })));
  expect([own.get().acknowledged.size, lastAction.get()]).toEqual([0, null]);
  expect(toast.get()).toBe('Not saved: Server busy or unreachable');
  expect(requests).toEqual([]);
});

test('a shelf is said with its reason and its end by the clock of the twin', async () => {
  const shelf = { verdict: 'critical', until: 5_000, reason: 'sprayed' } as const;
  const local = { ...NO_LOCAL_ALARMS, shelved: new Map([[faultKey(COLD), shelf]]) };
  const words = [
    ...wordsFor(NO_LOCAL_ALARMS, local, [COLD], (at) => at / 1000),
    ...wordsFor(local, NO_LOCAL_ALARMS, [COLD], () => null),
  ];
  for (const word of words) await word();
  const subject = 'alarm:cold';
  expect(requests.map(({ body }) => body)).toEqual([
    { kind: 'shelve', subject, text: 'sprayed', until: '5.000' },
    { kind: 'shelve', subject, until: null },
  ]);
});
