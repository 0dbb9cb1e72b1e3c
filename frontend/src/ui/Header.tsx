import type { JSX, ReactNode } from 'react';

import { rosText } from '../domain/time';
import { useApp, type AppState } from '../store/app';
import {
  phaseWord,
  selectHasOwnTime,
  selectIsPaused,
  selectIsRecorded,
  selectOrigin,
  selectShown,
} from '../store/moment';
import { S } from '../strings';
import { OriginNote, PastHeader } from '../timebar/Past';
import { Disclosure, Icon } from '../widgets/controls';
import { WithParts } from './loadDeferred';

/** The fleet's greenhouse that the page shows; undefined outside a fleet (no `/sites/` in the path). */
function siteName(): string | undefined {
  return /\/sites\/([^/]+)\/$/.exec(location.pathname)?.[1];
}

export function Header({ kiosk, children }: { kiosk: boolean; children?: ReactNode }): JSX.Element {
  return (
    <header className="header">
      <h1 className="brand">
        <img src="./lupin.svg" alt="" width="28" height="28" />
        <span>
          {S.product} <span className="brand-sub">{siteName() ?? S.subtitle}</span>
        </span>
      </h1>
      <PastHeader />
      {children}
      <OriginNote />
      <ConnectionBadge />
      {!kiosk && (
        <Disclosure label={S.menu} button={<Icon name="menu" />} className="menu">
          <WithParts>{(parts) => <parts.Menu />}</WithParts>
        </Disclosure>
      )}
    </header>
  );
}

/** The connection's state as a shape and a word; screen readers announce changes. */
export function ConnectionBadge(): JSX.Element {
  const phase = useApp((state) => state.twin.phase);
  const isPast = useApp((state) => selectShown(state).moment !== null);
  const isRecorded = useApp(selectIsRecorded);
  const isPaused = useApp(selectIsPaused);
  const isOfNow = !useApp(selectHasOwnTime) && !isPaused;
  const current = useApp(phaseWord);
  const isLive = phase === 'live';
  const isOwn = (isRecorded || isPaused) && isLive;
  const past = isLive ? S.past : `${S.past} · ${current}`;
  const word = isPast ? past : isOwn ? S.recordedIs[isPaused ? 'paused' : 'playing'] : current;
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
        {isLive && !isPast && <circle cx="8" cy="8" r="6" className={isOfNow ? 'solid' : 'ring'} />}
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

/** End of the simulated past, ROS seconds; null: the shown moment is outside it, or all is simulated. */
function selectSimulatedUntil(state: AppState): number | null {
  const { moment } = selectShown(state);
  const simulated = state.twin.connection.status?.journal.simulated;
  // In a pure simulation, later data is no more real.
  if (moment === null || !simulated || selectOrigin(state) === 'simulated') return null;
  return moment < simulated.end ? simulated.end : null;
}

/** Says that the shown data was not observed: a demo starts with simulated days. */
export function SimulatedNote(): JSX.Element {
  const until = useApp(selectSimulatedUntil);
  return (
    <div role="status" className="troubles simulated" data-testid="simulated">
      {until !== null && (
        <p>
          <strong>{S.simulated}</strong> <span>{S.simulatedHint(rosText(until))}</span>
        </p>
      )}
    </div>
  );
}
