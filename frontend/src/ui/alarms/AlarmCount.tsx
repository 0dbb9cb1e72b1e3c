import type { JSX } from 'react';

import { calling } from '../../alarms/list';
import { alarmList } from '../../alarms/watch';
import { useSelected } from '../../store/create';
import { S } from '../../strings';
import { HealthShape } from '../HealthMark';

/** "Alarms" and how many are active, with the sign of the worst that nobody has acknowledged. */
export function AlarmsLabel(): JSX.Element {
  const list = useSelected(alarmList, (it) => it);
  const unacknowledged = calling(list);
  const [worst] = unacknowledged;
  const { length } = list.active;
  return (
    <>
      {S.alarms}
      {length > 0 && (
        <span className="alarm-count" data-testid="alarm-count" aria-hidden="true">
          {worst && <HealthShape verdict={worst.verdict} />}
          {length}
        </span>
      )}
      <span className="unseen">, {S.alarmsCount(unacknowledged.length, length)}</span>
    </>
  );
}
