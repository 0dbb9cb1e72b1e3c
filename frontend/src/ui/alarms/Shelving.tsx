import { useLayoutEffect, useRef, useState, type JSX } from 'react';

import { LONGEST_REASON, needsReason, shelfMinutes } from '../../alarms/kept';
import type { Item } from '../../alarms/list';
import { shelveAlarm } from '../../alarms/own';
import { S } from '../../strings';
import { useClose } from '../../widgets/controls';
import { once } from './once';

/** Shelves an alarm for a while; a critical one for a shorter while, and with a reason. */
export function Shelving({ item, name }: { item: Item; name: string }): JSX.Element {
  const [reason, setReason] = useState('');
  const close = useClose();
  const root = useRef<HTMLDivElement>(null);
  const field = useRef<HTMLInputElement>(null);
  const isNeeded = needsReason(item.verdict);
  useLayoutEffect(() => {
    // What is typed at once is the reason, and no shortcut.
    (isNeeded ? field : root).current?.focus({ preventScroll: true });
  }, [isNeeded]);
  const given = reason.trim();
  return (
    <div className="shelf" ref={root} tabIndex={-1}>
      <strong>{S.alarmWhat(S.alarmShelve, name)}</strong>
      <p className="faint">{isNeeded ? S.alarmShelveCritical : S.alarmShelveHint}</p>
      <label>
        {isNeeded ? S.alarmShelfReason : S.alarmShelfReasonOptional}
        <input
          ref={field}
          type="text"
          value={reason}
          required={isNeeded}
          maxLength={LONGEST_REASON}
          autoComplete="off"
          onChange={(event) => {
            setReason(event.target.value);
          }}
        />
      </label>
      <div className="shelf-times">
        {shelfMinutes(item.verdict).map((minutes) => (
          <button
            key={minutes}
            type="button"
            disabled={isNeeded && given === ''}
            onClick={once(() => {
              close();
              shelveAlarm(item, minutes, given);
            })}
          >
            {minutes < 60 ? S.alarmShelveMinutes(minutes) : S.alarmShelveHours(minutes / 60)}
          </button>
        ))}
      </div>
    </div>
  );
}
