/** Puts the page's one store into a known state. */
import type { Field, Judgement, StatusFrame, TwinTagState } from '../contract/types';
import { INITIAL, step, type ConnectionEvent } from '../connection/machine';
import { prefer, receive, act } from '../store/app';
import { DEFAULT_SETTINGS } from '../store/settings';
import { withConnection, withField, withLatest, withState } from '../store/twin';
import { NOTHING } from '../store/fetcher';
import { DEFAULT_VIEW } from '../store/view';
import { NOBODY } from './health';
import { FILE } from './sensors';
import { stateFrame } from './tags';

export const status = (over: Partial<StatusFrame> = {}): StatusFrame => ({
  type: 'status',
  twin: 'live',
  reason: 'live',
  message: '',
  state_age_seconds: 0,
  has_map: true,
  origin: 'robot',
  twin_count: 1,
  input_problems: [],
  day_length_s: 86_400,
  drops: [],
  journal: { state: 'recording', detail: 'recording', set_aside: '', simulated: null },
  outward: [],
  ...over,
});

/** Soon after that of the readings of `testing/tags`. */
let stamp = 100;

/** The defaults, and a state with these tags and this judgement, just received. */
export function showTags(tags: readonly TwinTagState[], health: Judgement = NOBODY): void {
  act(DEFAULT_VIEW);
  prefer(DEFAULT_SETTINGS);
  receive({ sensors: { value: FILE, state: 'ready', message: '' }, remembered: NOTHING });
  receive({ unread: null, alarms: null, past: null, pastFault: null });
  receive(withLatest({ field: NOTHING, map: NOTHING, quality: null }));
  stamp += 1;
  const latest = stateFrame(tags, { sec: stamp, revision: `r${stamp}`, health });
  receive(withState(latest, performance.now()));
  goLive();
}

/** ROS seconds of the state that `showTags` shows next. */
export const nextStamp = (): number => stamp + 1;

export function showField(value: Field): void {
  receive(withField({ value, state: 'ready', message: '' }));
}

/** Runs a connection through events, and stores its state at `now`. */
export function connection(now: number, ...events: readonly ConnectionEvent[]): void {
  const last = events.reduce((current, event) => step(current, event, 1).connection, INITIAL);
  receive(withConnection(last, now));
}

const receivedEvents = (now: number, bridge: StatusFrame): ConnectionEvent[] => [
  { type: 'start', now },
  { type: 'opened', now },
  { type: 'frame', now, status: bridge },
  { type: 'frame', now, status: null },
];

/** A connection that last received something this long ago. */
export function goLive(bridge: StatusFrame = status(), silentMs = 0): void {
  const now = performance.now();
  connection(now + silentMs, ...receivedEvents(now, bridge));
}

export function goLost(): void {
  const now = performance.now();
  connection(now, ...receivedEvents(now, status()), { type: 'closed', now, code: 1006 });
}
