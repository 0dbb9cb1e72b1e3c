import type { JSX, ReactNode } from 'react';

import { ageSeconds, ageStep, type When } from '../domain/time';
import { ageText } from '../domain/format';
import { shown } from '../domain/text';
import { attemptOutcome } from '../domain/health';
import type { FailedAttempt } from '../domain/twin';
import { store, useApp } from '../store/app';
import { selectHasTime, selectShown, shownTime } from '../store/moment';
import { S } from '../strings';
import { useTicking } from '../widgets/useNow';

type Format = (seconds: number) => string;

const agoText: Format = (seconds) => S.agoSuffix(ageText(seconds));

/** What follows from the time as of which ages are shown (`shownTime`); it ticks. */
export function useShownTime<Part extends string | null>(part: (at: number | null) => Part): Part {
  // Only what can jump renders anew: each state sets the time.
  useApp((state) => selectShown(state).moment);
  useApp(selectHasTime);
  return useTicking((now) => part(shownTime(store.get(), now)));
}

/** The age as text, counting on where the shown moment does; null: unknown. */
const useAgeText = (when: When, format: Format): string | null =>
  useShownTime((at) => {
    const age = ageSeconds(when, at);
    return age === null ? null : format(age);
  });

/** Age step, for styling. */
export const useAgeStep = (when: When): ReturnType<typeof ageStep> =>
  useShownTime((at) => ageStep(ageSeconds(when, at)));

/** An age whose seconds tick in here, so that a table of hundreds of rows does not re-render. */
export function Age({ when, format = agoText }: { when: When; format?: Format }): JSX.Element {
  const text = useAgeText(when, format);
  const isWhole = useApp((state) => selectShown(state).snapshot?.isWhole ?? true);
  if (when === 'never') {
    return (
      <span className="age faint" title={isWhole ? S.neverObservedLong : S.notKnownThenLong}>
        {isWhole ? S.neverObserved : S.notKnown}
      </span>
    );
  }
  if (text !== null) return <span className="age">{text}</span>;
  return (
    <span className="age faint" title={when === 'unknown' ? S.ageUnreportedLong : S.ageUnknownLong}>
      {S.ageUnknown}
    </span>
  );
}

/** One entry of a `dl`. */
export const Fact = ({ label, children }: { label: string; children: ReactNode }): JSX.Element => (
  <div>
    <dt>{label}</dt>
    <dd>{children}</dd>
  </div>
);

export const AgeFact = ({ label, when }: { label: string; when: When }): JSX.Element => (
  <Fact label={label}>
    <Age when={when} />
  </Fact>
);

/** A failed attempt: when, and why. */
export function FailedAttemptText({ failed }: { failed: FailedAttempt }): JSX.Element {
  const age = useAgeText(failed.at, ageText);
  const outcome = S.attemptOutcomes[attemptOutcome(failed.status)];
  const text = S.reasons.scanFailed(outcome, age);
  const detail = failed.detail === '' ? '' : `: ${shown(failed.detail, 160)}`;
  return <span title={text + detail}>{text}</span>;
}
