import type { JSX } from 'react';

import { alarmOf, isAwaited } from '../alarms/list';
import { alarmList } from '../alarms/watch';
import type { HealthReason, TagHealth } from '../contract/types';
import { ageSeconds } from '../domain/time';
import { reasonText, todoText } from '../domain/health';
import { whenOf } from '../domain/twin';
import { useApp, type AppState } from '../store/app';
import { useSelected } from '../store/create';
import { selectCatalogue } from '../store/derived';
import { selectShown } from '../store/moment';
import { S } from '../strings';
import { useTicking } from '../widgets/useNow';
import { HealthShape } from './HealthMark';

/** A reason in words, with its age at the shown moment. */
export function useReasonText(reason: HealthReason | null, isMarked = false): string {
  const { snapshot, ageing } = useApp(selectShown);
  const unit = useApp((state) => state.settings.unit);
  const catalogue = useApp(selectCatalogue);
  return useTicking((now) => {
    if (!reason) return '';
    const when = reason.since && snapshot ? whenOf(reason.since, snapshot) : 'unknown';
    return reasonText(catalogue, reason, unit, ageSeconds(when, now, ageing), isMarked);
  });
}

/** A reason's text, for use beside its mark. */
export function Reason({ reason }: { reason: HealthReason }): JSX.Element {
  return <>{useReasonText(reason, true)}</>;
}

/** Reasons for a tag's verdict, the worst first. */
export function Reasons({
  health,
  most = Infinity,
  todoAt,
}: {
  health: TagHealth;
  most?: number;
  /** The tag's id, to add what to do about each reason. */
  todoAt?: string | undefined;
}): JSX.Element | null {
  const { reasons } = health;
  if (reasons.length === 0) return null;
  return (
    <ul className="reasons" aria-label={S.reasonsLabel} data-testid="reasons">
      {reasons.slice(0, most).map((reason) => (
        <li key={`${reason.kind} ${reason.sensor}`} data-kind={reason.kind}>
          <HealthShape verdict={reason.verdict} />
          <span>
            <Reason reason={reason} />
          </span>
          {todoAt !== undefined && <Todo tagId={todoAt} reason={reason} />}
        </li>
      ))}
      {reasons.length > most && <li className="faint">{S.cardMore(reasons.length - most)}</li>}
    </ul>
  );
}

/** What to do about a reason, and whether its alarm is still pending; nothing while shelved. */
function Todo({ tagId, reason }: { tagId: string; reason: HealthReason }): JSX.Element | null {
  const { active, shelved } = useSelected(alarmList);
  const isKnown = useApp(selectAreAlarmsKnown);
  if (alarmOf(shelved, tagId, reason)) return null;
  const isWaiting = isKnown && isAwaited(reason) && !alarmOf(active, tagId, reason);
  return (
    <span>
      <strong>{todoText(reason)}</strong>{' '}
      {isWaiting && <small className="faint">{S.alarmNotYet}</small>}
    </span>
  );
}

/** Whether the current alarms are known. */
export const selectAreAlarmsKnown = ({ twin: { alarms } }: AppState): boolean =>
  alarms !== null && alarms.source !== 'starting';
