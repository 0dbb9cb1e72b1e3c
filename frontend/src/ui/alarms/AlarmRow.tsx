import { memo, useState, type JSX } from 'react';

import { followAlarm } from '../../alarms/follow';
import { SHELF_MINUTES } from '../../alarms/kept';
import type { Item } from '../../alarms/list';
import { seeAlarms, shelveAlarm, unshelveAlarm } from '../../alarms/own';
import { selectSpeech } from '../../alarms/speech';
import { alarmText, spanText, whatText, whereText, worstText } from '../../alarms/words';
import { clockText } from '../../domain/format';
import { store, useApp } from '../../store/app';
import { rosNow } from '../../store/moment';
import { S } from '../../strings';
import { useTicking } from '../../widgets/useNow';
import { HealthMark } from '../HealthMark';

/** One alarm: what, where, since when, how bad at worst, until when; it leads there. */
export const AlarmRow = memo(function AlarmRow({ item }: { item: Item }): JSX.Element {
  const { alarm, verdict, isSeen } = item;
  const speech = useApp(selectSpeech);
  const isActive = alarm.cleared_at === null;
  return (
    <li data-alarm={alarm.id} data-where={alarm.tag_id} data-health={verdict} data-seen={isSeen}>
      <button
        type="button"
        className="alarm-go"
        title={S.alarmFollow}
        onClick={() => {
          followAlarm(item);
        }}
      >
        <HealthMark verdict={verdict} word={false} />
        <span className="alarm-text">
          <span>
            <strong>
              <bdi>{whereText(alarm)}</bdi>
            </strong>
            {': '}
            {whatText(alarm, speech)}
          </span>
          <Facts item={item} />
        </span>
        {/* What is active has a button that says so. */}
        {!isSeen && !isActive && <span className="alarm-new">{S.alarmNew}</span>}
      </button>
      {isActive && <Tools item={item} what={alarmText(alarm, speech)} />}
    </li>
  );
});

/** Since when, how bad, and what this browser made of it. */
function Facts({ item: { alarm, shelvedUntil } }: { item: Item }): JSX.Element {
  const speech = useApp(selectSpeech);
  const span = useTicking((now) => spanText(alarm, rosNow(store.get(), now)));
  const facts = [
    span,
    worstText(alarm, speech),
    shelvedUntil === null ? null : S.alarmShelved(clockText(shelvedUntil)),
  ];
  return (
    <span className="alarm-facts faint">{facts.filter((fact) => fact !== null).join(' · ')}</span>
  );
}

function Tools({ item, what }: { item: Item; what: string }): JSX.Element {
  const [isChoosing, setChoosing] = useState(false);
  if (item.shelvedUntil !== null) {
    return (
      <div className="alarm-tools">
        <button
          type="button"
          aria-label={S.alarmUnshelveOf(what)}
          onClick={() => {
            unshelveAlarm(item.alarm);
          }}
        >
          {S.alarmUnshelve}
        </button>
      </div>
    );
  }
  return (
    <div className="alarm-tools">
      {!item.isSeen && (
        <button
          type="button"
          aria-label={S.alarmSeenOf(what)}
          onClick={() => {
            seeAlarms([item]);
          }}
        >
          {S.alarmSeen}
        </button>
      )}
      <button
        type="button"
        title={S.alarmShelveHint}
        aria-label={S.alarmShelveOf(what)}
        aria-expanded={isChoosing}
        onClick={() => {
          setChoosing(!isChoosing);
        }}
      >
        {S.alarmShelve}
      </button>
      {isChoosing &&
        SHELF_MINUTES.map((minutes) => (
          <button
            key={minutes}
            type="button"
            onClick={() => {
              setChoosing(false);
              shelveAlarm(item, minutes);
            }}
          >
            {minutes < 60 ? S.alarmShelveMinutes(minutes) : S.alarmShelveHours(minutes / 60)}
          </button>
        ))}
    </div>
  );
}
