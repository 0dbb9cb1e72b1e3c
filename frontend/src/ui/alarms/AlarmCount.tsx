import type { JSX } from 'react';

import { calling } from '../../alarms/list';
import { alarmList } from '../../alarms/watch';
import { countNow, worstNow } from '../../alarms/speech';
import { useApp } from '../../store/app';
import { useSelected } from '../../store/create';
import { S } from '../../strings';
import { HealthShape } from '../HealthMark';
import { selectAreAlarmsKnown } from '../Reasons';

/**
 * "Alarms" and how many are active; with the sign of the worst now and how many of them are so, until
 * all are acknowledged. Who looks back reads that they are those of now.
 */
export function AlarmsLabel(): JSX.Element {
  const list = useSelected(alarmList, (it) => it);
  const unacknowledged = calling(list);
  const { length } = list.active;
  const isKnown = useApp(selectAreAlarmsKnown);
  const isNow = useApp((state) => state.view.moment === null);
  const worst = useApp((state) =>
    unacknowledged.length === 0 ? null : worstNow(state, list.active),
  );
  const worstCount = useApp((state) => (worst ? countNow(state, list.active, worst) : length));
  return (
    <>
      {S.alarms}
      {length > 0 && (
        <span className="alarm-count" data-testid="alarm-count" aria-hidden="true">
          {worst && isNow && <HealthShape verdict={worst} />}
          {worstCount < length && isNow && `${worstCount}/`}
          {isNow ? length : S.alarmNow(String(length))}
        </span>
      )}
      {isKnown && <span className="unseen">, {S.alarmsCount(unacknowledged.length, length)}</span>}
    </>
  );
}
