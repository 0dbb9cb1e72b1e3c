import type { JSX } from 'react';

import { epochOf } from '../clock';
import type { StatusFrame } from '../contract/types';
import { clockText, ageText } from '../domain/format';
import { retryConnection } from '../store/live';
import { useApp } from '../store/app';
import { selectNewest, selectShown } from '../store/moment';
import { S } from '../strings';
import { More } from '../widgets/controls';
import { useNow } from '../widgets/useNow';

/** Why the bridge calls the twin offline, for a person. */
export function offlineReason(status: StatusFrame | null): string {
  return (status && S.offlineWhy[status.reason]) || S.frozenWhy.offline;
}

/** The same for whoever looks after the machines; empty: there is nothing to add. */
export const offlineMore = (status: StatusFrame | null): string =>
  status ? S.offlineMore[status.reason] : '';

/** Across the page whenever what it shows is not the present. */
export function FrozenBanner(): JSX.Element | null {
  const phase = useApp((state) => state.twin.phase);
  const takenAt = useApp((state) => selectNewest(state).snapshot?.takenAt);
  const isTimeLost = useApp((state) => state.twin.isTimeLost);
  const connection = useApp((state) => state.twin.connection);
  const isPast = useApp((state) => selectShown(state).moment !== null);
  const now = useNow();
  if (phase === 'live' || takenAt === undefined) return null;
  const { socket } = connection;
  const wait = socket.kind === 'closed' ? Math.ceil((socket.retryAt - now) / 1000) : 0;
  return (
    <div className="frozen" role="alert" data-testid="frozen">
      <strong>{(isPast ? S.frozenBehindPast : S.frozenSince)(clockText(epochOf(takenAt)))}</strong>
      {/* What counts on by itself is not read out each second. */}
      {!isTimeLost && (
        <span aria-hidden="true" className="frozen-age">
          {S.agoSuffix(ageText(Math.max(0, now - takenAt) / 1000))}
        </span>
      )}
      <span className="frozen-why">
        {phase === 'offline' ? offlineReason(connection.status) : S.frozenWhy[phase]}
      </span>
      {phase === 'offline' && <More label={S.more} text={offlineMore(connection.status)} />}
      {isPast && <span>{S.frozenPastStays}</span>}
      {phase === 'reconnecting' && (
        <>
          <span aria-hidden="true">{S.nextTry(Math.max(0, wait))}</span>
          <button type="button" onClick={retryConnection}>
            {S.retryNow}
          </button>
        </>
      )}
    </div>
  );
}
