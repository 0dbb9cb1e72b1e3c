import { useLayoutEffect, useRef, useState, type JSX } from 'react';

import { LONGEST_REASON, needsReason, shelfMinutes } from '../../alarms/kept';
import type { Item } from '../../alarms/list';
import { shelveAlarm } from '../../alarms/own';
import { S } from '../../strings';
import { Disclosure, useClose } from '../../widgets/Disclosure';
import { Either } from './Either';
import { once } from './once';

/** Between the buttons and the panel, and beyond that. */
const GAP_PX = 20;

/** Shelves an alarm for a while; a critical one for a shorter while, and with a reason. */
export function Shelving({ item, name }: { item: Item; name: string }): JSX.Element {
  return (
    <Disclosure
      label={S.alarmShelveOf(name)}
      button={<Either texts={[S.alarmShelve, S.alarmUnshelve]} at={0} />}
      className="shelving"
      look="shelve"
    >
      <Choice item={item} />
    </Disclosure>
  );
}

function Choice({ item }: { item: Item }): JSX.Element {
  const [reason, setReason] = useState('');
  const close = useClose();
  const root = useRef<HTMLDivElement>(null);
  useLayoutEffect(() => {
    if (root.current) openClear(root.current);
  }, []);
  const isNeeded = needsReason(item.verdict);
  const given = reason.trim();
  return (
    <div className="shelf" ref={root}>
      <p className="faint">{isNeeded ? S.alarmShelveCritical : S.alarmShelveHint}</p>
      <label>
        {isNeeded ? S.alarmShelfReason : S.alarmShelfReasonOptional}
        <input
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

/** Below its button, or above it where the list ends too soon: never over it. */
function openClear(content: HTMLElement): void {
  const panel = content.closest<HTMLElement>('.disclosure-panel');
  const tools = content.closest('.alarm-tools')?.getBoundingClientRect();
  const list = content.closest('.alarms')?.getBoundingClientRect();
  if (!panel || !tools || !list) return;
  const below = list.bottom - tools.bottom;
  const isAbove = below < panel.offsetHeight + GAP_PX && tools.top - list.top > below;
  panel.dataset['above'] = String(isAbove);
}
