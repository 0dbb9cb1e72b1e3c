import { Fragment, type JSX } from 'react';

import { tagsOf, tagsText } from '../../alarms/arrange';
import { showAlarm } from '../../alarms/follow';
import { countsNow, selectNow, todoNow } from '../../alarms/latest';
import { groupOf, oldestOf, unacknowledged, type AlarmList, type Item } from '../../alarms/list';
import { partsText, whereText } from '../../alarms/words';
import type { Alarm } from '../../contract/types';
import { airOf } from '../../domain/health';
import { useApp, useContent } from '../../store/app';
import { selectCatalogue } from '../../store/derived';
import { S } from '../../strings';
import { Icon } from '../../widgets/controls';
import { HealthMark } from '../HealthMark';
import { AlarmFacts, AlarmTimes, AlarmTodo, useValues } from './AlarmFacts';
import { elsewhereText, shelvedText } from './AlarmRow';
import { AlarmTools } from './AlarmTools';
import { useWhoAcknowledged } from './people';

/**
 * Heading of alarms that share a cause, aligned with their rows: what is wrong, what to do, at which tags,
 * and the values of the worst one. A click shows or hides the rows; of a single tag, it shows the tag too.
 */
export function CauseHeading({
  cause,
  items,
  group,
  isOpen,
  onToggle,
}: {
  cause: string;
  /** The worst first; if resolved, the last one. */
  items: readonly Item[];
  group: keyof AlarmList;
  isOpen: boolean;
  onToggle: () => void;
}): JSX.Element | null {
  // While the order is held, alarms that left the group are still listed.
  const own = items.filter((item) => groupOf(item) === group);
  const shown = own.length > 0 ? own : items;
  const [first] = shown;
  const tags = tagsOf(items);
  const isOfOne = tags.length === 1;
  const sensors = useApp(selectCatalogue);
  const by = first?.alarm.acknowledged_by;
  const isByOne = shown.every(({ alarm }) => alarm.acknowledged_by === by);
  const who = useWhoAcknowledged(isByOne && first ? first.alarm : null);
  const counts = useContent((state) => countsNow(state, shown));
  const todo = useApp((state) => todoNow(state, shown));
  const parts = useApp((state) => partsText(shown, sensors, (alarm) => selectNow(state, alarm)));
  const [worst] = counts;
  if (!first || !worst) return null;
  const { alarm } = first;
  const [verdict] = worst;
  const isOver = group === 'resolved';
  // What was resolved last stands first.
  const times = isOver ? alarm : (oldestOf(shown) ?? alarm);
  const waiting = group === 'active' ? unacknowledged(own) : [];
  const status = own.length === 0 ? elsewhereText(first) : (who ?? S.healthAcknowledged);
  const shelves = new Set(shown.map((item) => shelvedText(item, item.shelf?.reason ?? '')));
  return (
    <div
      className="alarm-cause"
      data-cause={cause}
      data-health={verdict}
      data-where={isOfOne ? alarm.tag_id : undefined}
    >
      <button
        type="button"
        className="alarm-go"
        aria-expanded={isOpen}
        onClick={() => {
          onToggle();
          if (isOfOne) showAlarm(alarm);
        }}
      >
        <span className="alarm-main">
          <AlarmTimes alarm={times} first={null} verdict={verdict} isOver={isOver} />
          <span className="alarm-text">
            <span>
              <strong>{isOfOne ? S.alarmWhat(whereText(alarm), cause) : cause}</strong>{' '}
              <span className="alarm-many">
                {S.alarmCount(own.length)}{' '}
                {!isOfOne &&
                  own.length > 0 &&
                  counts.length > 1 &&
                  counts.map(([each, count]) => (
                    <Fragment key={each}>
                      <HealthMark verdict={each} word={false} /> {count}{' '}
                    </Fragment>
                  ))}
                <Icon name="chevron" />
              </span>
            </span>
            {group === 'active' && <AlarmTodo text={todo} />}
            {group === 'shelved' && (
              <span className="alarm-facts faint">{[...shelves].join('; ')}</span>
            )}
            {(!isOfOne || airOf(alarm.reason)) && (
              <span className="alarm-facts faint">{isOfOne ? parts : tagsText(tags)}</span>
            )}
          </span>
        </span>
        <Values alarm={alarm} of={isOfOne ? '' : whereText(alarm)} />
      </button>
      {isOver ? (
        // To align with the rows' columns.
        <div className="alarm-tools" />
      ) : (
        <AlarmTools
          items={shown}
          waiting={waiting}
          name={cause}
          status={waiting.length > 0 ? null : group === 'active' ? status : ''}
        />
      )}
    </div>
  );
}

const Values = ({ alarm, of }: { alarm: Alarm; of: string }): JSX.Element => (
  <AlarmFacts alarm={alarm} values={useValues(alarm)} of={of} />
);
