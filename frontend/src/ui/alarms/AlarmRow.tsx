import { memo, type JSX } from 'react';

import { goToStart, showAlarm } from '../../alarms/follow';
import type { Item } from '../../alarms/list';
import { acknowledgeAlarms, unacknowledgeAlarm, unshelveAlarm } from '../../alarms/own';
import { selectSpeech } from '../../alarms/speech';
import { nameText, whereText } from '../../alarms/words';
import { Comments } from '../../notes/Comments';
import { useApp } from '../../store/app';
import { S } from '../../strings';
import { HealthMark } from '../HealthMark';
import { AlarmFacts, useValues } from './AlarmFacts';
import { Either } from './Either';
import { once } from './once';
import { Shelving } from './Shelving';

export type GroupName = 'active' | 'shelved' | 'resolved';

/** One alarm: what, where, how bad now and at worst, since when; it leads to its tag as it is now. */
export const AlarmRow = memo(function AlarmRow({
  item,
  group,
}: {
  item: Item;
  /** Where the row stands: while the order is held, not where the alarm belongs by now. */
  group: GroupName;
}): JSX.Element {
  const { alarm, verdict, isAcknowledged, shelf } = item;
  const belongs = alarm.cleared_at !== null ? 'resolved' : shelf !== null ? 'shelved' : 'active';
  const isSelected = useApp((state) => state.view.selected === alarm.tag_id);
  const values = useValues(alarm);
  const current = values.state?.kind === 'known' ? values.state.verdict : verdict;
  const name = useApp((state) => nameText(alarm, selectSpeech(state)));
  return (
    <li
      data-alarm={alarm.id}
      data-where={alarm.tag_id}
      data-health={verdict}
      data-acknowledged={isAcknowledged}
      data-elsewhere={group !== belongs}
      data-selected={isSelected}
    >
      <button
        type="button"
        className="alarm-go"
        title={S.alarmShow}
        onClick={() => {
          showAlarm(alarm);
        }}
      >
        <HealthMark verdict={current} word={false} />
        <span className="alarm-text">
          <span className="alarm-what">
            <span>
              <strong>
                <bdi>{whereText(alarm)}</bdi>
              </strong>
              {': '}
              {values.what}
            </span>
            {group !== 'resolved' && (
              <span className="alarm-do" data-again={current === 'healthy' || undefined}>
                {values.todo}
              </span>
            )}
          </span>
          <AlarmFacts item={item} values={values} isShelved={group !== 'resolved'} />
        </span>
      </button>
      <Tools item={item} group={group} name={name} />
      <Comments subject={`alarm:${alarm.id}`} name={name} isOfNow />
    </li>
  );
});

function Tools({ item, group, name }: { item: Item; group: GroupName; name: string }): JSX.Element {
  const { alarm, isAcknowledged, shelf } = item;
  const canLookBack = useApp((state) => state.twin.remembered.state !== 'off');
  return (
    <div className="alarm-tools">
      <button
        type="button"
        aria-label={(isAcknowledged ? S.alarmUnacknowledgeOf : S.alarmAcknowledgeOf)(name)}
        onClick={once(() => {
          if (isAcknowledged) unacknowledgeAlarm(alarm);
          else acknowledgeAlarms([item]);
        })}
      >
        <Either texts={[S.alarmAcknowledge, S.alarmUnacknowledge]} at={isAcknowledged ? 1 : 0} />
      </button>
      {shelf !== null ? (
        <button
          type="button"
          aria-label={S.alarmUnshelveOf(name)}
          onClick={once(() => {
            unshelveAlarm(alarm);
          })}
        >
          <Either texts={[S.alarmShelve, S.alarmUnshelve]} at={1} />
        </button>
      ) : (
        group !== 'resolved' && <Shelving item={item} name={name} />
      )}
      <button
        type="button"
        disabled={!canLookBack}
        aria-label={S.alarmStartOf(name)}
        onClick={() => {
          goToStart(alarm);
        }}
      >
        {S.alarmStart}
      </button>
    </div>
  );
}
