import { useState, type JSX } from 'react';

import type { Period } from '../domain/period';
import { act } from '../store/app';
import { S } from '../strings';
import { fieldOf, momentOf } from './ownTimes';

type Own = Extract<Period, { kind: 'own' }>;

/** From when to when; what makes no period is not in use, and says so. */
export function OwnPeriod({
  period,
  isSimulated,
}: {
  period: Own;
  isSimulated: boolean;
}): JSX.Element {
  const [typed, setTyped] = useState({
    from: fieldOf(period.from, isSimulated),
    to: fieldOf(period.to, isSimulated),
  });
  const from = momentOf(typed.from, isSimulated);
  const to = momentOf(typed.to, isSimulated);
  const isPeriod = from !== null && to !== null && from < to;
  const take = (next: typeof typed): void => {
    setTyped(next);
    const [begin, end] = [momentOf(next.from, isSimulated), momentOf(next.to, isSimulated)];
    if (begin === null || end === null || begin >= end) return;
    act({ type: 'period', period: { kind: 'own', from: begin, to: end } });
  };
  const input = (name: 'from' | 'to', label: string): JSX.Element => (
    <label>
      <span>{label}</span>
      <input
        type={isSimulated ? 'text' : 'datetime-local'}
        step={isSimulated ? undefined : 1}
        placeholder={isSimulated ? 'hh:mm:ss' : undefined}
        value={typed[name]}
        aria-invalid={!isPeriod}
        onChange={(event) => {
          take({ ...typed, [name]: event.target.value });
        }}
      />
    </label>
  );
  return (
    <div className="timebar-own">
      {input('from', S.timebarFrom)}
      {input('to', S.timebarTo)}
      {!isPeriod && (
        <span role="status">{isSimulated ? S.timebarOwnSimHint : S.timebarOwnHint}</span>
      )}
    </div>
  );
}
