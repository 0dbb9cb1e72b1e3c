import { useMemo, type JSX } from 'react';

import { epochOf } from '../../clock';
import { alarmOf } from '../../alarms/list';
import { alarmList } from '../../alarms/watch';
import { clockText } from '../../domain/format';
import { isBad, worstReason } from '../../domain/health';
import { rosText, secondsOf } from '../../domain/rostime';
import { useApp } from '../../store/app';
import { useSelected } from '../../store/create';
import { selectNewestHealth } from '../../store/derived';
import { selectNewest, selectShown } from '../../store/moment';
import { S } from '../../strings';

/** What the list is about, and what it does not know. */
export function AlarmNotes({ isEmpty }: { isEmpty: boolean }): JSX.Element {
  const alarms = useApp((state) => state.twin.alarms);
  const moment = useApp((state) => selectShown(state).moment);
  const phase = useApp((state) => state.twin.phase);
  const takenAt = useApp((state) => selectNewest(state).snapshot?.takenAt ?? null);
  const isStarting = alarms?.source === 'starting';
  // Of a silent twin the bridge goes on to tell: that is an alarm itself.
  const isLost = phase !== 'live' && phase !== 'offline';
  const isKnown = alarms !== null && !isLost && !isStarting;
  const isLast = isLost && takenAt !== null;
  const listed = useSelected(alarmList, (it) => it);
  const health = useApp(selectNewestHealth);
  const waiting = useMemo(() => {
    const all = [...listed.active, ...listed.shelved];
    return [...(health?.byTag ?? [])].filter(
      ([id, own]) => isBad(own.verdict) && !alarmOf(all, id, worstReason(own)),
    ).length;
  }, [listed, health]);
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
      {isKnown && waiting > 0 && <p data-note="wait">{S.alarmsWait(waiting)}</p>}
      {isEmpty && isKnown && <p className="faint">{S.alarmsNoneHint}</p>}
      {alarms?.source === 'heard' && alarms.since && (
        <p className="faint" data-note="heard">
          {S.alarmsHeard(rosText(secondsOf(alarms.since)))}
        </p>
      )}
    </div>
  );
}
