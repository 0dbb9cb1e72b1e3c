import { useId, useMemo, type JSX, type ReactNode } from 'react';

import { alarmOf, isAwaited } from '../../alarms/list';
import { isPushed, notifyState, soundState, setNotify, setSound } from '../../alarms/notify';
import { lastAction, undo } from '../../alarms/own';
import { severalNow } from '../../alarms/latest';
import { alarmList, dismissMeanwhile, meanwhile } from '../../alarms/watch';
import { shown } from '../../domain/text';
import { rosText } from '../../domain/time';
import { act, useApp, type AppState } from '../../store/app';
import { useSelected } from '../../store/create';
import { selectLatestHealth } from '../../store/derived';
import {
  selectClockFault,
  selectIsDisconnected,
  selectLatest,
  selectShown,
} from '../../store/moment';
import { S } from '../../strings';
import { Check, IconButton } from '../../widgets/controls';
import { HealthMark } from '../HealthMark';
import { selectAreAlarmsKnown } from '../Reasons';
import { ignoreDoubleClick } from './AlarmTools';

/** How many tags have a reason that waits for a second scan; null: none, or unknown. */
export function AlarmsWait(): JSX.Element | null {
  const isKnown = useApp(selectIsKnown);
  const listed = useSelected(alarmList);
  const health = useApp(selectLatestHealth);
  const waiting = useMemo(() => {
    const all = [...listed.active, ...listed.shelved];
    return [...(health?.byTag ?? [])].filter(([id, { reasons }]) =>
      reasons.some((each) => isAwaited(each) && !alarmOf(all, id, each)),
    ).length;
  }, [listed, health]);
  if (!isKnown || waiting === 0) return null;
  return <p data-note="wait">{S.alarmsWait(waiting)}</p>;
}

// With a silent twin, alarms stay known: the silence itself is an alarm.
const selectIsKnown = (state: AppState): boolean =>
  selectAreAlarmsKnown(state) && !selectIsDisconnected(state);

/** Notes above the list: what it covers, and what is unknown. */
export function AlarmNotes({ isEmpty }: { isEmpty: boolean }): JSX.Element {
  const alarms = useApp((state) => state.twin.alarms);
  const moment = useApp((state) => selectShown(state).moment);
  const isStarting = alarms?.source === 'starting';
  const isKnown = useApp(selectIsKnown);
  const lacksTime = useApp(selectClockFault) !== null;
  // The banner says from when.
  const isLast = useApp(
    (state) => selectIsDisconnected(state) && selectLatest(state).snapshot !== null,
  );
  return (
    <div className="alarm-notes">
      {moment !== null && !isLast && <p data-note="now">{S.alarmsOfNow(rosText(moment))}</p>}
      {isLast && <p data-note="lost">{S.alarmsLost}</p>}
      {lacksTime && <p data-note="no-time">{S.alarmsNoTime}</p>}
      {isStarting && !lacksTime && <p data-note="starting">{S.alarmsStarting}</p>}
      {isEmpty && !isLast && !lacksTime && (
        <p className="alarm-none" data-note={isKnown ? 'none' : 'unknown'}>
          {isKnown ? S.alarmsNone : S.alarmsNotYet}
        </p>
      )}
      {isEmpty && <AlarmsWait />}
      {isEmpty && isKnown && !lacksTime && <p className="faint">{S.alarmsNoneHint}</p>}
      {alarms?.source === 'heard' && alarms.since !== null && (
        <p className="faint" data-note="heard">
          {S.alarmsReceived(rosText(alarms.since))}
        </p>
      )}
    </div>
  );
}

/**
 * Says that alarms were raised while a past moment is shown, and links back to live. Without
 * `data-over-map`: it comes and goes by itself, and the map must not move for it under a finger.
 */
export function Meanwhile(): JSX.Element | null {
  const items = useSelected(meanwhile);
  const [worst] = items;
  const text = useApp((state) =>
    severalNow(state, items, ([first = ''], more) => S.alarmsMeanwhile(first, more), 1),
  );
  if (!worst) return null;
  const { alarm } = worst;
  const { verdict } = alarm.reason;
  return (
    <div className="meanwhile" data-testid="meanwhile" data-health={verdict}>
      <HealthMark verdict={verdict} word={false} />
      <strong>{text}</strong>
      <button type="button" onClick={() => act({ moment: null, selected: alarm.tag_id || null })}>
        {alarm.tag_id === '' ? S.backToLive : S.meanwhileShow(shown(alarm.tag_id, 24))}
      </button>
      <IconButton icon="close" label={S.cardClose} onClick={dismissMeanwhile} />
    </div>
  );
}

/** Line above the list: new alarms that a held list does not show yet, and the last action to undo. */
export function LastActionLine({
  added,
  onShow,
  children,
}: {
  /** Number of new alarms not listed yet. */
  added: number;
  onShow: () => void;
  /** Actions on the whole list. */
  children: ReactNode;
}): JSX.Element {
  const last = useSelected(lastAction);
  return (
    <div className="alarm-line">
      {children}
      <div className="alarm-news" role="status" data-testid="alarm-line">
        {added > 0 && (
          <button type="button" data-line="new" title={S.alarmsNewHint} onClick={onShow}>
            {S.alarmsNew(added)}
          </button>
        )}
        {last && (
          <span data-line="done">
            {S.alarmDone[last.what](last.count)}{' '}
            <button type="button" onClick={ignoreDoubleClick(undo)}>
              {S.alarmUndo}
            </button>
          </span>
        )}
      </div>
    </div>
  );
}

/** Opt-in sound and notifications for alarms while nobody is looking at the page. */
export function NotifySettings(): JSX.Element {
  const settings = useApp((state) => state.settings);
  const sound = useSelected(soundState);
  const notify = useSelected(notifyState);
  const isPossible = notify === 'granted' || notify === 'prompt';
  const also = useSelected(isPushed) ? ` ${S.alarmNotifyPushed}` : '';
  return (
    <>
      <Way
        label={S.alarmSound}
        isOn={settings.sound && sound !== 'none'}
        isPossible={sound !== 'none'}
        // While sound is off, "waits" does not apply.
        hint={S.alarmSoundHints[settings.sound || sound === 'none' ? sound : 'ready']}
        onChange={setSound}
      />
      <Way
        label={S.alarmNotify}
        isOn={settings.notify && notify === 'granted'}
        isPossible={isPossible}
        hint={isPossible ? S.alarmNotifyHint + also : S.alarmNotifyNot[notify]}
        onChange={setNotify}
      />
    </>
  );
}

function Way({
  label,
  isOn,
  isPossible,
  hint,
  onChange,
}: {
  label: string;
  isOn: boolean;
  isPossible: boolean;
  hint: string;
  onChange: (isRequested: boolean) => Promise<void>;
}): JSX.Element {
  const id = useId();
  return (
    <div>
      <Check
        label={label}
        isOn={isOn}
        disabled={!isPossible}
        aria-describedby={id}
        onChange={(isRequested) => void onChange(isRequested)}
      />
      <p className="faint" id={id} role="status">
        {hint}
      </p>
    </div>
  );
}
