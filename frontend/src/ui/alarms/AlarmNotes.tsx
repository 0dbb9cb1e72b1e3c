import { useMemo, type JSX } from 'react';

import { epochOf } from '../../clock';
import { alarmOf, isAwaited } from '../../alarms/list';
import { alarmList } from '../../alarms/watch';
import { clockText } from '../../domain/format';
import { rosText, secondsOf } from '../../domain/time';
import { useApp, type AppState } from '../../store/app';
import { useSelected } from '../../store/create';
import { selectNewestHealth } from '../../store/derived';
import { selectNewest, selectShown } from '../../store/moment';
import { S } from '../../strings';

/** At how many tags something waits for a second scan; null: none, or nobody knows. */
export function AlarmsWait(): JSX.Element | null {
  const isKnown = useApp(selectIsKnown);
  const listed = useSelected(alarmList, (it) => it);
  const health = useApp(selectNewestHealth);
  const waiting = useMemo(() => {
    const all = [...listed.active, ...listed.shelved];
    return [...(health?.byTag ?? [])].filter(([id, { reasons }]) =>
      reasons.some((each) => isAwaited(each) && !alarmOf(all, id, each)),
    ).length;
  }, [listed, health]);
  if (!isKnown || waiting === 0) return null;
  return <p data-note="wait">{S.alarmsWait(waiting)}</p>;
}

// Of a silent twin the bridge goes on to tell: that is an alarm itself.
const isLostOf = ({ twin: { phase } }: AppState): boolean =>
  phase !== 'live' && phase !== 'offline';

const selectIsKnown = (state: AppState): boolean => {
  const { alarms } = state.twin;
  return alarms !== null && alarms.source !== 'starting' && !isLostOf(state);
};

/** What the list is about, and what it does not know. */
export function AlarmNotes({ isEmpty }: { isEmpty: boolean }): JSX.Element {
  const alarms = useApp((state) => state.twin.alarms);
  const moment = useApp((state) => selectShown(state).moment);
  const takenAt = useApp((state) => selectNewest(state).snapshot?.takenAt ?? null);
  const isStarting = alarms?.source === 'starting';
  const isKnown = useApp(selectIsKnown);
  const isLast = useApp(isLostOf) && takenAt !== null;
  return (
    <div className="alarm-notes">
      {moment !== null && <p data-note="now">{S.alarmsOfNow(rosText(moment))}</p>}
      {isLast && <p data-note="lost">{S.alarmsLost(clockText(epochOf(takenAt)))}</p>}
      {isStarting && <p data-note="starting">{S.alarmsStarting}</p>}
      {isEmpty && !isLast && (
        <p className="alarm-none" data-note={isKnown ? 'none' : 'unknown'}>
          {isKnown ? S.alarmsNone : S.alarmsNotYet}
        </p>
      )}
      {isEmpty && <AlarmsWait />}
      {isEmpty && isKnown && <p className="faint">{S.alarmsNoneHint}</p>}
      {alarms?.source === 'heard' && alarms.since && (
        <p className="faint" data-note="heard">
          {S.alarmsHeard(rosText(secondsOf(alarms.since)))}
        </p>
      )}
    </div>
  );
}
