import type { JSX } from 'react';

import type { HealthReason, TagHealth } from '../contract/types';
import { ageSeconds } from '../domain/age';
import { reasonText, todoText } from '../domain/reasons';
import { whenOf } from '../domain/twin';
import { useApp } from '../store/app';
import { selectCatalogue } from '../store/derived';
import { selectShown } from '../store/moment';
import { S } from '../strings';
import { useTicking } from '../widgets/useNow';
import { HealthShape } from './HealthMark';

/** A reason in words, with its age as of the moment that is shown. */
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

/** Beside its sign. */
export function Reason({ reason }: { reason: HealthReason }): JSX.Element {
  return <>{useReasonText(reason, true)}</>;
}

/** Why a tag has its verdict, the worst first; nothing where there is no reason. */
export function Reasons({
  health,
  most = Infinity,
  hasTodo = false,
}: {
  health: TagHealth;
  most?: number;
  /** With what to do about each. */
  hasTodo?: boolean;
}): JSX.Element | null {
  const { reasons } = health;
  const catalogue = useApp(selectCatalogue);
  if (reasons.length === 0) return null;
  return (
    <ul className="reasons" aria-label={S.reasonsLabel} data-testid="reasons">
      {reasons.slice(0, most).map((reason) => (
        <li key={`${reason.kind} ${reason.sensor}`} data-kind={reason.kind}>
          <HealthShape verdict={reason.verdict} />
          <span>
            <Reason reason={reason} />
          </span>
          {hasTodo && <strong>{todoText(catalogue, reason)}</strong>}
        </li>
      ))}
      {reasons.length > most && <li className="faint">{S.cardMore(reasons.length - most)}</li>}
    </ul>
  );
}
