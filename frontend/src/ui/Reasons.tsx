import type { JSX } from 'react';

import { alarmOf, isAwaited } from '../alarms/list';
import { alarmList } from '../alarms/watch';
import type { HealthReason, TagHealth } from '../contract/types';
import { isOldReading, type TagThen } from '../domain/difference';
import { ageSeconds, type When } from '../domain/time';
import { reasonText, todoText } from '../domain/health';
import { whenOf } from '../domain/twin';
import { useApp, type AppState } from '../store/app';
import { useSelected } from '../store/create';
import { selectCatalogue, selectHealth } from '../store/derived';
import { selectIsReceiving, selectShown, selectTag } from '../store/moment';
import { S } from '../strings';
import { useTicking } from '../widgets/useNow';
import { HealthShape } from './HealthMark';

/** A reason in words, with the age at the shown moment of what it is about. */
export function useReasonText(
  reason: HealthReason | null,
  isMarked = false,
  /** Empty: the greenhouse. */
  tagId = '',
): string {
  const { snapshot, ageing } = useApp(selectShown);
  const tag = useApp((state) => selectTag(state, tagId));
  const health = useApp((state) => selectHealth(state).byTag.get(tagId));
  const isReceiving = useApp(selectIsReceiving);
  const catalogue = useApp(selectCatalogue);
  return useTicking((now) => {
    if (!reason) return '';
    const when =
      tag && health
        ? whenShown(reason, { tag, health }, isReceiving)
        : reason.since && snapshot
          ? whenOf(reason.since, snapshot)
          : 'unknown';
    return reasonText(catalogue, reason, ageSeconds(when, now, ageing), isMarked);
  });
}

/** When the attempt or reading behind a tag's reason was made; null: the text needs no age. */
function whenShown(
  { kind, sensor, since }: HealthReason,
  then: TagThen,
  isReceiving: boolean,
): When | null {
  const { failedAttempt, readAt, scannedAt } = then.tag;
  if (kind === 'scan_failed') return failedAttempt?.at ?? 'unknown';
  const isRecent = isReceiving && !isOldReading(sensor, then);
  return (kind === 'old' ? since !== null : sensor !== '' && !isRecent)
    ? (readAt.get(sensor) ?? scannedAt)
    : null;
}

/** A reason's text, for use beside its mark. */
function Reason({ reason, tagId }: { reason: HealthReason; tagId: string }): JSX.Element {
  return <>{useReasonText(reason, true, tagId)}</>;
}

/** Reasons for a tag's verdict, the worst first. */
export function Reasons({
  health,
  tagId,
  most = Infinity,
  hasTodo = false,
}: {
  health: TagHealth;
  tagId: string;
  most?: number;
  /** Whether to add what to do about each reason. */
  hasTodo?: boolean;
}): JSX.Element | null {
  const { reasons } = health;
  if (reasons.length === 0) return null;
  return (
    <ul className="reasons" aria-label={S.reasonsLabel} data-testid="reasons">
      {reasons.slice(0, most).map((reason) => (
        <li key={`${reason.kind} ${reason.sensor}`} data-kind={reason.kind}>
          <HealthShape verdict={reason.verdict} />
          <span>
            <Reason reason={reason} tagId={tagId} />
          </span>
          {hasTodo && <Todo tagId={tagId} reason={reason} />}
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
  const isNone = !alarmOf(active, tagId, reason);
  const isWaiting = isKnown && isAwaited(reason) && isNone;
  return (
    <span>
      {/* A single failed scan is ordinary. */}
      {!(isNone && reason.kind === 'scan_failed') && <strong>{todoText(reason)}</strong>}{' '}
      {isWaiting && <small className="faint">{S.alarmNotYet}</small>}
    </span>
  );
}

/** Whether the current alarms are known. */
export const selectAreAlarmsKnown = ({ twin: { alarms } }: AppState): boolean =>
  alarms !== null && alarms.source !== 'starting';
