/**
 * Syncs acknowledgements and shelves with the bridge, in both directions. `own` mirrors them, so that
 * the list, its sound and its counts see them. Without a signed-in user, `own` stays in this browser.
 */
import { now, timeOfDay } from '../../clock';
import { fetchSession, postNote, withdrawNote } from '../../contract/people';
import type { Alarm, Session } from '../../contract/types';
import { whenText } from '../../alarms/words';
import { failureText } from '../../domain/format';
import { shown } from '../../domain/text';
import { keepFetched, onChange, store, useApp } from '../../store/app';
import { rosNow, selectIsDisconnected } from '../../store/moment';
import { mayAct, PAGE, person, useSelected } from '../../store/create';
import { say } from '../toast';
import { S } from '../../strings';
import { useTicking } from '../../widgets/useNow';
import { C } from '../../notes/NoteMarks';
import {
  acting,
  lastAction,
  LONGEST_REASON,
  own,
  faultKey,
  type LocalAlarms,
} from '../../alarms/own';

const PACE_MS = 500;

/** Requests still being sent: until they are done, the bridge's state is older than ours. */
let pending = 0;

/** Tolerance for a shelf's end, ms: the bridge has ROS time, we keep it by this browser's clock. */
const SAME_MS = 3_000;

/** `local`, updated to the bridge's alarms; what the bridge does not have is removed. */
export function merged(
  local: LocalAlarms,
  alarms: readonly Alarm[],
  untilOf: (alarm: Alarm) => number | null,
): LocalAlarms {
  const acknowledged = new Map(local.acknowledged);
  const shelved = new Map(local.shelved);
  let isSame = true;
  for (const alarm of alarms) {
    const { id, acknowledged_at: at, shelved_by: by, reason } = alarm;
    const { verdict } = reason;
    const what = faultKey(alarm);
    if (at != null) {
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
  return isSame ? local : { ...local, acknowledged, shelved };
}

const alarmsNow = (): readonly Alarm[] => store.get().twin.alarms?.alarms ?? [];

/** When a shelf ends by this browser's clock, ms since the epoch. */
function endOf(alarm: Alarm): number | null {
  const nowS = rosNow(store.get(), now());
  if (alarm.shelved_until == null || nowS === null) return null;
  return Math.floor(timeOfDay() + (alarm.shelved_until - nowS) * 1000);
}

function take(): void {
  if (!person.get()?.name || pending > 0 || store.get().twin.alarms === null) return;
  own.set(merged(own.get(), alarmsNow(), endOf));
}

/** The requests that tell the bridge what changed here. */
export function wordsFor(
  before: LocalAlarms,
  next: LocalAlarms,
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
    const [shelf, shelfNow] = [
      before.shelved.get(faultKey(alarm)),
      next.shelved.get(faultKey(alarm)),
    ];
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

async function share(before: LocalAlarms, next: LocalAlarms): Promise<void> {
  const nowS = rosNow(store.get(), now());
  const at = timeOfDay();
  const words = wordsFor(before, next, alarmsNow(), (until) =>
    nowS === null ? null : nowS + (until - at) / 1000,
  );
  const { alarms } = store.get().twin;
  // Without a connection, do not send: it would look done until the request failed.
  let failure = selectIsDisconnected(store.get()) ? S.serverBusy : null;
  pending += 1;
  try {
    // Sequential, in list order: of two conflicting requests, the later one wins.
    if (failure === null) for (const word of words) await word();
  } catch (error) {
    failure = failureText(error);
  }
  pending -= 1;
  if (failure !== null) {
    say(C.failed(failure));
    lastAction.set(null);
  }
  // The frame with the changes may follow the answer; merging the old frame would revert them.
  if (failure !== null || store.get().twin.alarms !== alarms) take();
}

/** Fetches the signed-in user on each connection. */
export function startPeople(signal = PAGE): void {
  // On failure, everything stays as it is until a retry succeeds.
  keepFetched<Session>(
    {
      paceMs: PACE_MS,
      parts: ({ twin }) => [twin.connection.epoch],
      onValue: (found) => {
        person.set(found);
        acting.share = found.can_write_notes ? (before, next) => void share(before, next) : null;
        take();
      },
    },
    ({ twin }) => ({
      // The first connection opens during this fetch, to the same bridge: no need to fetch again.
      key: String(Math.max(1, twin.connection.epoch)),
      group: 'session',
      run: fetchSession,
    }),
    signal,
  );
  onChange(({ twin }) => [twin.alarms], take, signal);
  signal.addEventListener('abort', () => {
    acting.share = null;
    person.set(null);
  });
}

/** Whether the user may act on alarms; refused: actions are shared, and the bridge does not answer. */
export function useActing(): { readonly isAble: boolean; readonly isRefused: boolean } {
  const who = useSelected(person);
  const isRefused = useApp(selectIsDisconnected) && who?.can_write_notes === true;
  return { isAble: mayAct(who), isRefused };
}

/** Says whether actions stay in this browser or are shared. */
export function sharingText(who: Session | null): string {
  if (!who?.name) return S.alarmsMine;
  if (who.can_write_notes) return C.shared(who.name);
  return (who.role === 'viewer' ? C.reads : C.elsewhere)(who.name);
}

/** Who acknowledged an alarm, and when; null: no name known. */
export function useWhoAcknowledged(alarm: Alarm | null): string | null {
  const name = alarm?.acknowledged_by;
  const at = alarm?.acknowledged_at;
  const when = useTicking((tick) => (at == null ? '' : whenText(at, rosNow(store.get(), tick))));
  return name && when !== '' ? S.alarmAcknowledgedBy(name, when) : null;
}
