import type { JSX } from 'react';

import { useApp } from '../store/app';
import { selectHasOwnTime, selectIsRecorded, selectShown } from '../store/moment';
import { S } from '../strings';

/** The connection's state in a shape and a word; told to screen readers when it changes. */
export function ConnectionBadge(): JSX.Element {
  const phase = useApp((state) => state.twin.phase);
  const isPast = useApp((state) => selectShown(state).moment !== null);
  const isRecorded = useApp(selectIsRecorded);
  const isOfNow = !useApp(selectHasOwnTime);
  const isPaused = useApp((state) => state.twin.connection.status?.reason === 'paused');
  const word =
    isRecorded && phase === 'live' && !isPast
      ? S.recordedIs[isPaused ? 'paused' : 'playing']
      : (isPast ? S.phasePast : S.phase)[phase];
  return (
    <div
      className="connection"
      role="status"
      data-testid="connection"
      data-phase={phase}
      data-past={isPast}
      data-of-now={isOfNow}
    >
      <span className="unseen">{S.phaseLabel}: </span>
      <svg viewBox="0 0 16 16" width="14" height="14" aria-hidden="true">
        {phase === 'live' && !isPast && (
          <circle cx="8" cy="8" r="6" className={isOfNow ? 'solid' : 'ring'} />
        )}
        {(phase === 'connecting' || phase === 'reconnecting') && (
          <circle cx="8" cy="8" r="6" className="ring turning" />
        )}
        {(phase === 'stale' || phase === 'offline') && (
          <>
            <circle cx="8" cy="8" r="6" className="ring" />
            <path d="M3.8 12.2l8.4-8.4" className="ring" />
          </>
        )}
      </svg>
      <span>{word}</span>
    </div>
  );
}
