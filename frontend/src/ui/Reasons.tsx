import type { JSX } from 'react';

import { alarmOf, isAwaited } from '../alarms/list';
import { alarmList } from '../alarms/watch';
import type { HealthReason, TagHealth } from '../contract/types';
import { isOldReading, type TagThen } from '../domain/difference';
import { ageSeconds, type When } from '../domain/time';
import { byCause, causeText, todoText } from '../domain/health';
import { useApp, type AppState } from '../store/app';
import { useSelected } from '../store/create';
import { selectCatalogue, selectHealth } from '../store/derived';
import { selectIsReceiving, selectTag } from '../store/moment';
import { S } from '../strings';
import { useShownTime } from './Age';
import { HealthShape } from './HealthMark';

/** Reasons of one cause in words, with the age at the shown moment of what they are about. */
export function useCauseText(
  reasons: readonly HealthReason[],
  isMarked = false,
  /** Empty: the greenhouse. */
  tagId = '',
): string {
  const tag = useApp((state) => selectTag(state, tagId));
  const health = useApp((state) => selectHealth(state).byTag.get(tagId));
  const isReceiving = useApp(selectIsReceiving);
  const catalogue = useApp(selectCatalogue);
  return useShownTime((at) => {
    const [reason] = reasons;
    if (!reason) return '';
    const when = tag && health ? whenShown(reason, { tag, health }, isReceiving) : reason.since;
    return causeText(catalogue, reasons, ageSeconds(when, at), isMarked);
  });
}

/** When the attempt, inspection or reading behind a tag's reason was made; null: the text needs no age. */
function whenShown(
  { kind, sensor, since }: HealthReason,
  then: TagThen,
  isReceiving: boolean,
): When | null {
  const { failedAttempt, inspectedAt, readAt, scannedAt } = then.tag;
  if (kind === 'pest') return inspectedAt;
  if (kind === 'scan_failed') return failedAttempt?.at ?? 'unknown';
  const isRecent = isReceiving && !isOldReading(sensor, then);
  return (kind === 'old' ? since !== null : sensor !== '' && !isRecent)
    ? (readAt.get(sensor) ?? scannedAt)
    : null;
}

interface CauseProps {
  readonly reasons: readonly [HealthReason, ...HealthReason[]];
  readonly tagId: string;
}

/** A cause's text, for use beside its mark. */
function Cause({ reasons, tagId }: CauseProps): JSX.Element {
  return <>{useCauseText(reasons, true, tagId)}</>;
}

/** Causes of a tag's verdict, the worst first. */
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
  const causes = byCause(health.reasons);
  if (causes.length === 0) return null;
  return (
    <ul className="reasons" aria-label={S.reasonsLabel} data-testid="reasons">
      {causes.slice(0, most).map((reasons) => (
        <li key={`${reasons[0].kind} ${reasons[0].sensor}`} data-kind={reasons[0].kind}>
          <HealthShape verdict={reasons[0].verdict} />
          <span>
            <Cause reasons={reasons} tagId={tagId} />
          </span>
          {hasTodo && <Todo reasons={reasons} tagId={tagId} />}
        </li>
      ))}
      {causes.length > most && <li className="faint">{S.cardMore(causes.length - most)}</li>}
    </ul>
  );
}

/** What to do about a cause, and whether its alarm is still pending; nothing while shelved. */
function Todo({ tagId, reasons }: CauseProps): JSX.Element | null {
  const { active, shelved } = useSelected(alarmList);
  const isKnown = useApp(selectAreAlarmsKnown);
  const [reason] = reasons;
  if (reasons.every((each) => alarmOf(shelved, tagId, each))) return null;
  const isNone = reasons.every((each) => !alarmOf(active, tagId, each));
  const isWaiting = isKnown && isAwaited(reason) && isNone;
  return (
    <span>
      {/* A single failed scan is ordinary. */}
      {!(isKnown && isNone && reason.kind === 'scan_failed') && (
        <strong>{todoText(reason)}</strong>
      )}{' '}
      {isWaiting && <small className="faint">{S.alarmNotYet}</small>}
    </span>
  );
}

/** Whether the current alarms are known. */
export const selectAreAlarmsKnown = ({ twin: { alarms } }: AppState): boolean =>
  alarms !== null && alarms.source !== 'starting';
