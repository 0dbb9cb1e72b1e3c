import type { JSX } from 'react';

import type { Verdict } from '../contract/types';
import { MARKS } from '../domain/marks';
import { S } from '../strings';

/** The same mark as the tag's pin has: one shape each, so that it is told without colour. */
export function HealthShape({ verdict }: { verdict: Verdict }): JSX.Element {
  return (
    <span className="health-mark" data-health={verdict}>
      <VerdictMark verdict={verdict} />
    </span>
  );
}

export function HealthMark({
  verdict,
  word = true,
  text = S.health[verdict],
}: {
  verdict: Verdict;
  /** Without the word to see, it is still there to hear. */
  word?: boolean;
  text?: string | undefined;
}): JSX.Element {
  return (
    <span className="health-mark" data-health={verdict}>
      <VerdictMark verdict={verdict} />
      <span className={word ? undefined : 'unseen'}>{text}</span>
    </span>
  );
}

function VerdictMark({ verdict }: { verdict: Verdict }): JSX.Element {
  const { outline, sign } = MARKS[verdict];
  return (
    // As large as leaves room for its line.
    <svg viewBox="-1.2 -1.2 2.4 2.4" width="16" height="16" aria-hidden="true">
      <path d={outline} className="body" />
      {sign !== '' && <path d={sign} className="sign" />}
    </svg>
  );
}
