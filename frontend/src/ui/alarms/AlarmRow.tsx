import { memo, type JSX } from 'react';

import { showAlarm } from '../../alarms/follow';
import { groupOf, type AlarmList, type Item } from '../../alarms/list';
import { lastKnown, nameText, whereText } from '../../alarms/words';
import { minuteText } from '../../domain/format';
import { CommentList } from '../../notes/Comments';
import { useApp } from '../../store/app';
import { selectCatalogue } from '../../store/derived';
import { S } from '../../strings';
import { AlarmFacts, AlarmTimes, AlarmTodo, useValues } from './AlarmFacts';
import { AlarmTools, ignoreDoubleClick } from './AlarmTools';
import { useWhoAcknowledged } from './people';

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
        onClick={ignoreDoubleClick(() => showAlarm(alarm))}
      >
        <span className="alarm-main">
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
            {group === 'active' && item.shelf?.reason && (
              <q className="faint">{item.shelf.reason}</q>
            )}
            {group === 'active' && !item.shelf && (
              <AlarmTodo
                text={values.todo}
                isAgain={isBack}
                isOfSilence={alarm.reason.kind === 'silent'}
              />
            )}
            {group === 'shelved' && item.shelf && (
              <span className="alarm-facts faint">{shelvedText(item, item.shelf.reason)}</span>
            )}
          </span>
        </span>
        <AlarmFacts alarm={alarm} values={values} />
      </button>
      <AlarmTools items={[item]} waiting={[item]} name={name} status={status} />
      <CommentList subject={`alarm:${alarm.id}`} moment={null} />
    </li>
  );
});

/** What was done about the alarm, or that a held row is resolved; null: neither. */
function useStatus(item: Item, group: keyof AlarmList): string | null {
  const { alarm, isAcknowledged } = item;
  const who = useWhoAcknowledged(alarm);
  if (group !== groupOf(item)) return elsewhereText(item);
  return isAcknowledged ? (who ?? S.healthAcknowledged) : null;
}

/** Until when an alarm is shelved, by whom, and why. */
export const shelvedText = ({ alarm, shelf }: Item, reason: string): string =>
  shelf ? S.alarmShelved(minuteText(shelf.until), reason, alarm.shelved_by ?? '') : '';

/** Why an alarm of a held list belongs to another group; null: it is active. */
export function elsewhereText(item: Item): string | null {
  const belongs = groupOf(item);
  return belongs === 'active'
    ? null
    : belongs === 'resolved'
      ? S.alarmResolved
      : shelvedText(item, '');
}
