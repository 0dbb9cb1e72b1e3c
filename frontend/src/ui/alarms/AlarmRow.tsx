import { memo, useLayoutEffect, useRef, useState, type JSX, type MouseEvent } from 'react';

import type { Alarm } from '../../contract/types';
import { goToStart, showAlarm } from '../../alarms/follow';
import { groupOf, type AlarmList, type Item } from '../../alarms/list';
import {
  acknowledgeAlarms,
  LONGEST_REASON,
  needsReason,
  shelfMinutes,
  shelveAlarm,
  unacknowledgeAlarm,
  unshelveAlarm,
} from '../../alarms/own';
import { lastKnown, nameText, whereText } from '../../alarms/words';
import { ageText, minuteText } from '../../domain/format';
import { C } from '../../notes/NoteMarks';
import { CommentField, CommentList } from '../../notes/Comments';
import { useApp } from '../../store/app';
import { mayAct, mayWithdraw, person, useSelected } from '../../store/create';
import { selectCatalogue } from '../../store/derived';
import { S } from '../../strings';
import { Disclosure, Icon, useClose } from '../../widgets/controls';
import { AlarmFacts, AlarmTimes, AlarmTodo, useValues } from './AlarmFacts';
import { useIsRefused, useWhoAcknowledged } from './people';

/** One alarm: since when, what, where, value now and at worst; a click shows its tag live. */
export const AlarmRow = memo(function AlarmRow({
  item,
  group,
}: {
  item: Item;
  /** The group that lists the row; while the order is held, the alarm may belong to another. */
  group: keyof AlarmList;
}): JSX.Element {
  const { alarm, isAcknowledged } = item;
  const { verdict } = alarm.reason;
  const isSelected = useApp((state) => state.view.selected === alarm.tag_id);
  const values = useValues(alarm);
  const known = lastKnown(values.state)?.verdict ?? verdict;
  const isBack = known === 'healthy';
  const name = useApp((state) => nameText(alarm, selectCatalogue(state)));
  const status = useStatus(item, group);
  return (
    <li
      data-alarm={alarm.id}
      data-where={alarm.tag_id}
      data-health={verdict}
      data-acknowledged={isAcknowledged}
      data-elsewhere={group !== groupOf(item)}
      data-selected={isSelected}
    >
      <button
        type="button"
        className="alarm-go"
        title={S.alarmShow}
        onClick={ignoreDoubleClick(() => {
          showAlarm(alarm);
        })}
      >
        <AlarmTimes
          alarm={alarm}
          first={values.first}
          // A bad value still counts when it is old; that all was well says nothing about now.
          verdict={isBack && values.state?.kind === 'unknown' ? 'unknown' : known}
          // Not from the alarm itself: a held row must not gain a line.
          isOver={group === 'resolved'}
        />
        <span className="alarm-text">
          <span>
            <strong>
              <bdi>{whereText(alarm)}</bdi>
            </strong>
            {': '}
            {values.what}
          </span>
          {/* A row held in "active" has no other line for the shelving reason. */}
          {group === 'active' && item.shelf?.reason && <q className="faint">{item.shelf.reason}</q>}
          {group === 'active' && !item.shelf && (
            <AlarmTodo
              text={values.todo}
              isAgain={isBack}
              isOfSilence={alarm.reason.kind === 'silent'}
            />
          )}
          {group === 'shelved' && item.shelf && (
            <span className="alarm-facts faint">
              {S.alarmShelved(
                minuteText(item.shelf.until),
                item.shelf.reason,
                alarm.shelved_by ?? '',
              )}
            </span>
          )}
        </span>
        <AlarmFacts alarm={alarm} values={values} />
      </button>
      <div className="alarm-tools">
        <Acknowledge
          label={S.alarmWhat(S.alarmAcknowledge, name)}
          text={S.alarmAcknowledge}
          status={status}
          onAcknowledge={() => {
            acknowledgeAlarms([item]);
          }}
        />
        <Disclosure
          label={S.alarmActionsOf(name)}
          button={<Icon name="dots" />}
          className="row-menu"
        >
          <Actions item={item} name={name} />
        </Disclosure>
      </div>
      <CommentList subject={`alarm:${alarm.id}`} moment={null} />
    </li>
  );
});

/** What was done about the alarm, or that a held row is resolved; null: neither. */
function useStatus(item: Item, group: keyof AlarmList): string | null {
  const { alarm, isAcknowledged, shelf } = item;
  const who = useWhoAcknowledged(alarm);
  const belongs = groupOf(item);
  if (group !== belongs && belongs === 'resolved') return S.alarmResolved;
  if (group !== belongs && shelf !== null) {
    return S.alarmShelved(minuteText(shelf.until), '', alarm.shelved_by ?? '');
  }
  return isAcknowledged ? (who ?? S.healthAcknowledged) : null;
}

/** An alarm's menu of further actions. */
function Actions({ item, name }: { item: Item; name: string }): JSX.Element {
  const { alarm, isAcknowledged, shelf } = item;
  const [form, setForm] = useState<'shelve' | 'comment' | null>(null);
  const close = useClose();
  const root = useRef<HTMLDivElement>(null);
  const who = useSelected(person);
  const isRefused = useIsRefused();
  useLayoutEffect(() => {
    root.current?.scrollIntoView({ block: 'nearest' });
  }, [form]);
  const act = (text: string, action: () => void, isPossible = !isRefused): JSX.Element => (
    <li>
      <button type="button" disabled={!isPossible} onClick={ignoreDoubleClick(action)}>
        {text}
      </button>
    </li>
  );
  const then = (action: (alarm: Alarm) => void) => () => {
    close();
    action(alarm);
  };
  return (
    <div className="row-actions" ref={root}>
      {form === 'shelve' && <Shelving alarm={alarm} name={name} />}
      {form === 'comment' && (
        <CommentField
          subject={`alarm:${alarm.id}`}
          moment={null}
          name={S.alarmWhat(C.comment, name)}
          onDone={close}
        />
      )}
      {form === null && (
        <ul className="menu-list">
          {act(S.alarmStart, then(goToStart), true)}
          {mayAct(who) && (
            <>
              {isAcknowledged &&
                (who === null || mayWithdraw(who, alarm.acknowledged_by ?? who.name)) &&
                act(S.alarmUnacknowledge, then(unacknowledgeAlarm))}
              {shelf !== null
                ? act(S.alarmUnshelve, then(unshelveAlarm))
                : alarm.cleared_at === null &&
                  act(S.alarmShelve, () => {
                    setForm('shelve');
                  })}
            </>
          )}
          {who?.can_write_notes === true &&
            act(C.comment, () => {
              setForm('comment');
            })}
        </ul>
      )}
    </div>
  );
}

/** Form to shelve an alarm; a critical one for a shorter time, and only with a reason. */
function Shelving({ alarm, name }: { alarm: Alarm; name: string }): JSX.Element {
  const [reason, setReason] = useState('');
  const close = useClose();
  const root = useRef<HTMLDivElement>(null);
  const field = useRef<HTMLInputElement>(null);
  const { verdict } = alarm.reason;
  const isNeeded = needsReason(verdict);
  useLayoutEffect(() => {
    // Focused at once, so that typing fills in the reason instead of running shortcuts.
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
        {shelfMinutes(verdict).map((minutes) => (
          <button
            key={minutes}
            type="button"
            disabled={isNeeded && given === ''}
            onClick={ignoreDoubleClick(() => {
              close();
              shelveAlarm(alarm, minutes, given);
            })}
          >
            {S.alarmShelveFor(ageText(minutes * 60))}
          </button>
        ))}
      </div>
    </div>
  );
}

/** The acknowledge button, or in the same place what was already done, so that nothing moves. */
export function Acknowledge({
  label,
  text,
  status,
  onAcknowledge,
}: {
  label: string;
  text: string;
  /** What was done; null: there is something to acknowledge. */
  status: string | null;
  onAcknowledge: () => void;
}): JSX.Element | null {
  const isAble = useSelected(person, mayAct);
  const isRefused = useIsRefused();
  if (!isAble) {
    return status === null ? null : (
      <span className="alarm-status" title={status}>
        <span>{status}</span>
      </span>
    );
  }
  // The same element in both states, so that the keyboard focus stays here.
  return (
    <button
      type="button"
      className={status === null ? 'text-button' : 'alarm-status'}
      title={status ?? undefined}
      aria-label={status === null ? label : undefined}
      aria-disabled={status !== null}
      disabled={isRefused}
      onClick={ignoreDoubleClick(() => {
        if (status === null) onAcknowledge();
      })}
    >
      <span>{status ?? text}</span>
    </button>
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
