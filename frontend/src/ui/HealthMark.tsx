import type { JSX } from 'react';

import type { HealthStatus } from '../domain/health';
import { S } from '../strings';

/** One shape each, so that the state is told without colour. */
const SHAPES: Readonly<Record<HealthStatus, JSX.Element>> = {
  healthy: (
    <>
      <circle cx="8" cy="8" r="7" className="body" />
      <path d="M4.8 8.2 7.1 10.4 11.2 5.9" className="mark" />
    </>
  ),
  stressed: (
    <>
      <path d="M8 1.2 15.2 14.4H.8Z" className="body" />
      <path d="M8 5.8v4M8 12.1v.01" className="mark" />
    </>
  ),
  critical: (
    <>
      <path d="M4.9.8h6.2l4.1 4.1v6.2l-4.1 4.1H4.9L.8 11.1V4.9Z" className="body" />
      <path d="M5.4 5.4l5.2 5.2M10.6 5.4l-5.2 5.2" className="mark" />
    </>
  ),
  'no-data': <circle cx="8" cy="8" r="6.3" className="hollow" />,
};

/** The shape alone, where the word stands beside it anyway. */
export function HealthShape({ status }: { status: HealthStatus }): JSX.Element {
  return (
    <span className="health-mark" data-health={status}>
      <svg viewBox="0 0 16 16" width="16" height="16" aria-hidden="true">
        {SHAPES[status]}
      </svg>
    </span>
  );
}

export function HealthMark({
  status,
  word = true,
}: {
  status: HealthStatus;
  /** Without the word to see, it is still there to hear. */
  word?: boolean;
}): JSX.Element {
  return (
    <span className="health-mark" data-health={status}>
      <svg viewBox="0 0 16 16" width="16" height="16" aria-hidden="true">
        {SHAPES[status]}
      </svg>
      <span className={word ? undefined : 'unseen'}>{S.health[status]}</span>
    </span>
  );
}
