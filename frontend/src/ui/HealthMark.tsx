import type { JSX } from 'react';

import type { Verdict } from '../contract/types';
import { MARKS, svgPath } from '../domain/marks';
import { S } from '../strings';

/** As large as leaves room for its line in a box of 16. */
const RADIUS = 6.7;

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
    <svg viewBox="0 0 16 16" width="16" height="16" aria-hidden="true">
      {outline === 'circle' ? (
        <circle cx="8" cy="8" r={RADIUS} className="body" />
      ) : (
        <path d={svgPath([outline], RADIUS, true)} className="body" />
      )}
      {sign.length > 0 && <path d={svgPath(sign, RADIUS)} className="sign" />}
    </svg>
  );
}
