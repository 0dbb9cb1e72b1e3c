import { useLayoutEffect, useRef, useState, type JSX, type MouseEvent } from 'react';

import { goToStart } from '../../alarms/follow';
import { oldestOf, type Item } from '../../alarms/list';
import {
  acknowledgeAlarms,
  LONGEST_REASON,
  needsReason,
  shelfMinutes,
  shelveAlarms,
  unacknowledgeAlarms,
  unshelveAlarms,
} from '../../alarms/own';
import { ageText } from '../../domain/format';
import { VERDICTS } from '../../domain/health';
import { CommentField } from '../../notes/Comments';
import { C } from '../../notes/NoteMarks';
import { mayWithdraw, person, useSelected } from '../../store/create';
import { S } from '../../strings';
import { Disclosure, Icon, useClose } from '../../widgets/controls';
import { useActing } from './people';

/** What an operator can do about an alarm, or about all of a heading. */
export function AlarmTools({
  items,
  waiting,
  name,
  status,
}: {
  items: readonly Item[];
  /** Those that the button acknowledges. */
  waiting: readonly Item[];
  name: string;
  /** What was done, in the button's place, so that nothing moves; null: not yet. Empty: neither. */
  status: string | null;
}): JSX.Element {
  const { isAble, isRefused } = useActing();
  const label = S.alarmWhat(S.alarmAcknowledge, name);
  return (
    <div className="alarm-tools">
      {/* The same element in both states, so that the keyboard focus stays here. */}
      {isAble && status !== '' ? (
        <button
          type="button"
          className={status === null ? 'text-button' : 'alarm-status'}
          title={status ?? undefined}
          aria-label={status === null ? label : undefined}
          aria-disabled={status !== null}
          disabled={isRefused}
          onClick={ignoreDoubleClick(() => {
            if (status === null) acknowledgeAlarms(waiting);
          })}
        >
          <span>{status ?? allText(S.alarmAcknowledge, waiting, items)}</span>
        </button>
      ) : (
        status && (
          <span className="alarm-status" title={status}>
            <span>{status}</span>
          </span>
        )
      )}
      <Disclosure label={S.alarmActionsOf(name)} button={<Icon name="dots" />} className="row-menu">
        <Actions items={items} name={name} />
      </Disclosure>
    </div>
  );
}

/** An action's name; on some of several alarms, with their number. */
const allText = (action: string, some: readonly Item[], all: readonly Item[]): string =>
  all.length === 1 ? action : S.alarmAll(action, some.length);

/** The menu of further actions. */
function Actions({ items, name }: { items: readonly Item[]; name: string }): JSX.Element {
  const [form, setForm] = useState<'shelve' | 'comment' | null>(null);
  const close = useClose();
  const root = useRef<HTMLDivElement>(null);
  const who = useSelected(person);
  const { isAble, isRefused } = useActing();
  useLayoutEffect(() => {
    root.current?.scrollIntoView({ block: 'nearest' });
  }, [form]);
  const oldest = oldestOf(items);
  const acknowledged = items.filter(
    ({ isAcknowledged, alarm: { acknowledged_by: by } }) =>
      isAcknowledged && (!who?.name || mayWithdraw(who, by ?? who.name)),
  );
  const shelved = items.filter(({ shelf }) => shelf !== null);
  const open = items.filter(({ alarm, shelf }) => shelf === null && alarm.cleared_at === null);
  const act = (text: string, action: () => void, isPossible = !isRefused): JSX.Element => (
    <li>
      <button type="button" disabled={!isPossible} onClick={ignoreDoubleClick(action)}>
        {text}
      </button>
    </li>
  );
  const onAll = (
    text: string,
    some: readonly Item[],
    action: (some: readonly Item[]) => void,
  ): JSX.Element | false =>
    isAble && some.length > 0 && act(allText(text, some, items), () => action(some));
  const then = (action: (some: readonly Item[]) => void) => (some: readonly Item[]) => {
    close();
    action(some);
  };
  return (
    <div className="row-actions" ref={root}>
      {form === 'shelve' && (
        <Shelving items={open} title={S.alarmWhat(allText(S.alarmShelve, open, items), name)} />
      )}
      {form === 'comment' && (
        <CommentField
          subjects={items.map(({ alarm }) => `alarm:${alarm.id}`)}
          moment={null}
          name={S.alarmWhat(C.comment, name)}
          onDone={close}
        />
      )}
      {form === null && (
        <ul className="menu-list">
          {oldest &&
            act(
              S.alarmStart,
              () => {
                close();
                goToStart(oldest);
              },
              true,
            )}
          {onAll(S.alarmUnacknowledge, acknowledged, then(unacknowledgeAlarms))}
          {onAll(S.alarmUnshelve, shelved, then(unshelveAlarms))}
          {onAll(S.alarmShelve, open, () => setForm('shelve'))}
          {who?.can_write_notes === true &&
            act(items.length === 1 ? C.comment : `${C.comment} (${items.length})`, () =>
              setForm('comment'),
            )}
        </ul>
      )}
    </div>
  );
}

/** Form to shelve alarms; if one of them is critical, for a shorter time, and only with a reason. */
function Shelving({ items, title }: { items: readonly Item[]; title: string }): JSX.Element {
  const [reason, setReason] = useState('');
  const close = useClose();
  const root = useRef<HTMLDivElement>(null);
  const field = useRef<HTMLInputElement>(null);
  const verdicts = items.map(({ alarm }) => alarm.reason.verdict);
  const verdict = VERDICTS.find((each) => verdicts.includes(each)) ?? 'healthy';
  const isNeeded = needsReason(verdict);
  useLayoutEffect(() => {
    // Focused at once, so that typing fills in the reason instead of running shortcuts.
    (isNeeded ? field : root).current?.focus({ preventScroll: true });
  }, [isNeeded]);
  const given = reason.trim();
  return (
    <div className="shelf" ref={root} tabIndex={-1}>
      <strong>{title}</strong>
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
          onChange={(event) => setReason(event.target.value)}
        />
      </label>
      <div className="shelf-times">
        {shelfMinutes(verdict).map((minutes) => (
          <button
            key={minutes}
            type="button"
            disabled={isNeeded && given === ''}
            onClick={ignoreDoubleClick(() => {
              close();
              shelveAlarms(items, minutes, given);
            })}
          >
            {S.alarmShelveFor(ageText(minutes * 60))}
          </button>
        ))}
      </div>
    </div>
  );
}

/** A second click at the same place within this time, ms, belongs to a double click. */
const AGAIN_MS = 600;
const SAME_PLACE_PX = 5;

let last = { at: -Infinity, x: 0, y: 0 };

/**
 * Ignores the second click of a double click: it would undo the first, or hit whatever has moved
 * there since.
 */
export const ignoreDoubleClick =
  (act: () => void) =>
  ({ detail, timeStamp, clientX, clientY }: MouseEvent): void => {
    const isAgain =
      timeStamp - last.at < AGAIN_MS &&
      Math.hypot(clientX - last.x, clientY - last.y) < SAME_PLACE_PX;
    // Each key press counts (detail 0).
    if (detail > 0 && isAgain) return;
    last = { at: timeStamp, x: clientX, y: clientY };
    act();
  };
