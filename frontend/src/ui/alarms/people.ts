/**
 * What people have said of alarms, by the bridge, and what is done here, to it. What stands there
 * is kept in `own` as well, so that the list, its sound and its counts know it; where nobody has
 * signed in, that stays this browser's own.
 */
import { now, timeOfDay } from '../../clock';
import { fetchSession, postNote, withdrawNote } from '../../contract/people';
import type { Alarm, Session } from '../../contract/types';
import { whenText } from '../../alarms/words';
import { failureText } from '../../domain/format';
import { secondsOf } from '../../domain/time';
import { shown } from '../../domain/text';
import { onChange, store, useApp } from '../../store/app';
import { createFetcher } from '../../store/fetcher';
import { rosNow, selectIsCut } from '../../store/moment';
import { person, useSelected } from '../../store/create';
import { say } from '../toast';
import { LANGUAGE, S } from '../../strings';
import { useTicking } from '../../widgets/useNow';
import { PEOPLE } from '../../words/people';
import { acting, done, LONGEST_REASON, own, whatOf, type Kept } from '../../alarms/own';

export const P = PEOPLE[LANGUAGE];

const PACE_MS = 500;

/** What was said here and is not there yet: until it is, the bridge's word is an older one. */
let pending = 0;

/** A shelf's end is told in whole ROS seconds and kept by this browser's clock: near is the same. */
const SAME_MS = 3_000;

/** `kept` with what the bridge says; what it does not say does not hold here either. */
export function merged(
  kept: Kept,
  alarms: readonly Alarm[],
  untilOf: (alarm: Alarm) => number | null,
): Kept {
  const acknowledged = new Map(kept.acknowledged);
  const shelved = new Map(kept.shelved);
  let isSame = true;
  for (const alarm of alarms) {
    const { id, acknowledged_at: at, shelved_by: by, reason } = alarm;
    const { verdict } = reason;
    const what = whatOf(alarm);
    if (at) {
      isSame &&= acknowledged.has(id);
      if (!acknowledged.has(id)) acknowledged.set(id, { verdict, at: timeOfDay() });
    } else if (acknowledged.delete(id)) {
      isSame = false;
    }
    if (alarm.cleared_at !== null) continue;
    const until = untilOf(alarm);
    const shelf = shelved.get(what);
    if (by && until !== null) {
      if (shelf && Math.abs(shelf.until - until) < SAME_MS) continue;
      isSame = false;
      const why = alarm.shelved_reason;
      shelved.set(what, { verdict, until, reason: why ? shown(why, LONGEST_REASON) : '' });
    } else if (shelved.delete(what)) {
      isSame = false;
    }
  }
  return isSame ? kept : { ...kept, acknowledged, shelved };
}

const alarmsNow = (): readonly Alarm[] => store.get().twin.alarms?.alarms ?? [];

/** When a shelf ends by this browser's clock, ms since the epoch. */
function endOf(alarm: Alarm): number | null {
  const nowS = rosNow(store.get(), now());
  if (!alarm.shelved_until || nowS === null) return null;
  return Math.floor(timeOfDay() + (secondsOf(alarm.shelved_until) - nowS) * 1000);
}

function take(): void {
  if (person.get() === null || pending > 0 || store.get().twin.alarms === null) return;
  own.set(merged(own.get(), alarmsNow(), endOf));
}

/** What has to be said for what was done here. */
export function wordsFor(
  before: Kept,
  next: Kept,
  alarms: readonly Alarm[],
  rosOf: (at: number) => number | null,
): readonly (() => Promise<void>)[] {
  const found: (() => Promise<void>)[] = [];
  for (const alarm of alarms) {
    const subject = `alarm:${alarm.id}`;
    const [was, is] = [before.acknowledged.get(alarm.id), next.acknowledged.get(alarm.id)];
    if (is && is !== was) found.push(() => postNote({ kind: 'acknowledge', subject }));
    if (was && !is) found.push(() => withdrawNote('acknowledge', subject));
    if (alarm.cleared_at !== null) continue;
    const [shelf, shelfNow] = [before.shelved.get(whatOf(alarm)), next.shelved.get(whatOf(alarm))];
    if (shelfNow && shelfNow !== shelf) {
      const until = rosOf(shelfNow.until);
      const note = { kind: 'shelve', subject, text: shelfNow.reason } as const;
      if (until !== null) found.push(() => postNote({ ...note, until: until.toFixed(3) }));
    } else if (shelf && !shelfNow) {
      found.push(() => postNote({ kind: 'shelve', subject, until: null }));
    }
  }
  return found;
}

async function tell(before: Kept, next: Kept): Promise<void> {
  const nowS = rosNow(store.get(), now());
  const at = timeOfDay();
  const words = wordsFor(before, next, alarmsNow(), (until) =>
    nowS === null ? null : nowS + (until - at) / 1000,
  );
  const { alarms } = store.get().twin;
  // What nobody answers is not even sent: until it failed, it would look done.
  let failure = selectIsCut(store.get()) ? S.serverBusy : null;
  pending += 1;
  try {
    // One behind the other, in the order of the list: of two words the later one stands.
    if (failure === null) for (const word of words) await word();
  } catch (error) {
    failure = failureText(error);
  }
  pending -= 1;
  if (failure !== null) {
    say(P.failed(failure));
    done.set(null);
  }
  // The frame that has them may come later than the answer: the one of before would take them back.
  if (failure !== null || store.get().twin.alarms !== alarms) take();
}

/** Asks who has signed in, on each connection anew; returns the way to stop. */
export function startPeople(): () => void {
  const session = createFetcher<Session>({
    paceMs: PACE_MS,
    onValue: (found) => {
      person.set(found.name ? found : null);
      acting.tell = found.can_write_notes ? (before, next) => void tell(before, next) : null;
      take();
    },
    onError: () => {
      // It is tried again; until there is an answer everything stays as it is.
    },
  });
  const update = (): void => {
    // The first connection is made while this is fetched, and to the same bridge.
    const epoch = Math.max(1, store.get().twin.connection.epoch);
    session.want({ key: String(epoch), group: 'session', run: fetchSession });
  };
  update();
  const stops = [
    onChange(({ twin }) => [twin.connection.epoch], update),
    onChange(({ twin }) => [twin.alarms], take),
  ];
  return () => {
    for (const stop of stops) stop();
    session.want(null);
    acting.tell = null;
    person.set(null);
  };
}

/** Whether what is done here would be refused: it is everybody's, and the bridge does not answer. */
export function useIsRefused(): boolean {
  const isShared = useSelected(person, (who) => who?.can_write_notes === true);
  return useApp(selectIsCut) && isShared;
}

/** Whether what is done here is this browser's own, or everybody's. */
export function whoseWord(who: Session | null): string {
  if (!who?.name) return S.alarmsMine;
  if (who.can_write_notes) return P.shared(who.name);
  return (who.role === 'viewer' ? P.reads : P.elsewhere)(who.name);
}

/** Who acknowledged an alarm, and when; null: no name is known. */
export function useWhoAcknowledged(alarm: Alarm | null): string | null {
  const name = alarm?.acknowledged_by;
  const at = alarm?.acknowledged_at;
  const when = useTicking((tick) => (at ? whenText(secondsOf(at), rosNow(store.get(), tick)) : ''));
  return name && when !== '' ? P.acknowledged(name, when) : null;
}
