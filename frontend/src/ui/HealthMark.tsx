import type { JSX } from 'react';

import type { Verdict } from '../contract/types';
import { MARKS } from '../domain/marks';
import { S } from '../strings';

/** The mark of a tag's pin, beside text that says the same. */
export const HealthShape = ({ verdict }: { verdict: Verdict }): JSX.Element => (
  <HealthMark verdict={verdict} text="" />
);

/** One shape per verdict, so that it reads without colour. */
export function HealthMark({
  verdict,
  word = true,
  text = S.health[verdict],
}: {
  verdict: Verdict;
  /** False: the word is for screen readers only. */
  word?: boolean;
  text?: string | undefined;
}): JSX.Element {
  const { outline, sign } = MARKS[verdict];
  return (
    <span className="health-mark" data-health={verdict}>
      {/* The view box leaves room for the stroke. */}
      <svg viewBox="-1.2 -1.2 2.4 2.4" width="16" height="16" aria-hidden="true">
        <path d={outline} className="body" />
        {sign !== '' && <path d={sign} className="sign" />}
      </svg>
      {text !== '' && <span className={word ? undefined : 'unseen'}>{text}</span>}
    </span>
  );
}
