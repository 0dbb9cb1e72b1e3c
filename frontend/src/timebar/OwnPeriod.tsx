import { type JSX, useState } from 'react';

import type { Period } from '../domain/period';
import { act } from '../store/app';
import { S } from '../strings';

type Own = Extract<Period, { kind: 'own' }>;

interface Typed {
  readonly from: string;
  readonly to: string;
}

/** Null: what is typed makes no period. */
function periodOf(typed: Typed, isSimulated: boolean): Own | null {
  const [from, to] = [momentOf(typed.from, isSimulated), momentOf(typed.to, isSimulated)];
  return from === null || to === null || from >= to ? null : { kind: 'own', from, to };
}

/** From when to when; what makes no period is not in use, and says so. */
export function OwnPeriod({
  period,
  isSimulated,
}: {
  period: Own;
  isSimulated: boolean;
}): JSX.Element {
  const inForce = {
    of: period,
    from: fieldOf(period.from, isSimulated),
    to: fieldOf(period.to, isSimulated),
  };
  const [last, setTyped] = useState(inForce);
  // A chart or a link may have chosen another period since.
  const typed = last.of === period ? last : inForce;
  const isPeriod = periodOf(typed, isSimulated) !== null;
  const take = (next: Typed): void => {
    const own = periodOf(next, isSimulated);
    setTyped({ ...next, of: own ?? period });
    if (own) act({ type: 'period', period: own });
  };
  const input = (name: keyof Typed, label: string): JSX.Element => (
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

/** Moments as the fields of an own period have them. Pure but for the operator's time zone. */

const two = (value: number): string => String(value).padStart(2, '0');

/** "2026-11-14T03:12:40" on the operator's clock; of a simulation "1:02:03". */
export function fieldOf(at: number, isSimulated: boolean): string {
  const seconds = Math.floor(at);
  if (isSimulated) {
    return `${Math.floor(seconds / 3_600)}:${two(Math.floor(seconds / 60) % 60)}:${two(seconds % 60)}`;
  }
  const date = new Date(seconds * 1000);
  const day = [date.getFullYear(), two(date.getMonth() + 1), two(date.getDate())].join('-');
  return `${day}T${[date.getHours(), date.getMinutes(), date.getSeconds()].map(two).join(':')}`;
}

/** ROS seconds; null: that is no time. */
export function momentOf(text: string, isSimulated: boolean): number | null {
  if (isSimulated) {
    const parts = /^(\d{1,6}):([0-5]\d)(?::([0-5]\d))?$/.exec(text.trim());
    if (!parts) return null;
    return Number(parts[1]) * 3_600 + Number(parts[2]) * 60 + Number(parts[3] ?? 0);
  }
  const epochMs = /^\d{4,6}-\d\d-\d\dT/.test(text) ? new Date(text).getTime() : NaN;
  return Number.isFinite(epochMs) && epochMs >= 0 ? epochMs / 1000 : null;
}
