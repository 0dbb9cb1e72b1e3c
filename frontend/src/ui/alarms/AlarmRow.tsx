import { memo, type JSX } from 'react';

import { showAlarm } from '../../alarms/follow';
import { groupOf, type AlarmList, type Item } from '../../alarms/list';
import { acknowledgeAlarms } from '../../alarms/own';
import { selectSpeech } from '../../alarms/speech';
import { nameText, whereText } from '../../alarms/words';
import { clockText } from '../../domain/format';
import { Said } from '../../notes/Comments';
import { useApp } from '../../store/app';
import { S } from '../../strings';
import { Acknowledge } from './Acknowledge';
import { AlarmFacts, AlarmTimes, useValues } from './AlarmFacts';
import { once } from './once';
import { RowMenu } from './RowMenu';
import { useWhoAcknowledged } from './WhoseWord';

/** One alarm: for how long, what and where, now and at worst; it leads to its tag as it is now. */
export const AlarmRow = memo(function AlarmRow({
  item,
  group,
}: {
  item: Item;
  /** Where the row stands: while the order is held, not where the alarm belongs by now. */
  group: keyof AlarmList;
}): JSX.Element {
  const { alarm, verdict, isAcknowledged } = item;
  const isSelected = useApp((state) => state.view.selected === alarm.tag_id);
  const values = useValues(alarm);
  const current = values.state?.kind === 'known' ? values.state.verdict : verdict;
  const name = useApp((state) => nameText(alarm, selectSpeech(state)));
  const status = useStatus(item, group);
  // While the order is held, it has no line for that: nothing is to be done meanwhile.
  const shelf = group === 'active' ? item.shelf : null;
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
        onClick={once(() => {
          showAlarm(alarm);
        })}
      >
        <AlarmTimes
          alarm={alarm}
          first={values.first}
          verdict={current}
          // Meanwhile, a row that is held gets no line more.
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
          {shelf?.reason && <q className="faint">{shelf.reason}</q>}
          {!shelf && group !== 'resolved' && (
            <span className="alarm-do" data-again={current === 'healthy' || undefined}>
              {values.todo}
            </span>
          )}
          {group === 'shelved' && item.shelf && (
            <span className="alarm-facts faint">
              {S.alarmShelved(
                clockText(item.shelf.until),
                item.shelf.reason,
                alarm.shelved_by ?? '',
              )}
            </span>
          )}
        </span>
        <AlarmFacts item={item} values={values} />
      </button>
      <div className="alarm-tools">
        <Acknowledge
          label={S.alarmAcknowledgeOf(name)}
          text={S.alarmAcknowledge}
          status={status}
          onAcknowledge={() => {
            acknowledgeAlarms([item]);
          }}
        />
        <RowMenu item={item} name={name} />
      </div>
      <Said subject={`alarm:${alarm.id}`} moment={null} />
    </li>
  );
});

/** What has been done about it, or that it is over where it still stands above; null: nothing. */
function useStatus(item: Item, group: keyof AlarmList): string | null {
  const { alarm, isAcknowledged, shelf } = item;
  const who = useWhoAcknowledged(alarm);
  const belongs = groupOf(item);
  if (group !== belongs && belongs === 'resolved') return S.alarmResolved;
  if (group !== belongs && shelf !== null) {
    return S.alarmShelved(clockText(shelf.until), '', alarm.shelved_by ?? '');
  }
  return isAcknowledged ? (who ?? S.healthAcknowledged) : null;
}
