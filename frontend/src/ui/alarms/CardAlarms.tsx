import type { JSX } from 'react';

import { oldestOf, unacknowledged, type Item } from '../../alarms/list';
import { acknowledgeAlarms, unshelveAlarms } from '../../alarms/own';
import { selectKnownSince, todoNow, worstNow } from '../../alarms/latest';
import { spanText, whatText } from '../../alarms/words';
import { alarmList } from '../../alarms/watch';
import { minuteText } from '../../domain/format';
import { store, useApp } from '../../store/app';
import { useSelected } from '../../store/create';
import { selectCatalogue } from '../../store/derived';
import { rosNow } from '../../store/moment';
import { S } from '../../strings';
import { useTicking } from '../../widgets/useNow';
import { ignoreDoubleClick } from './AlarmTools';
import { useActing, useWhoAcknowledged } from './people';

/** A tag's alarms on its card: active since when, or shelved until when. */
export function CardAlarms({ tagId }: { tagId: string }): JSX.Element {
  return (
    <>
      <Active tagId={tagId} />
      <Shelved tagId={tagId} />
    </>
  );
}

function Active({ tagId }: { tagId: string }): JSX.Element | null {
  const active = useSelected(alarmList, (list) => list.active);
  const items = active.filter(({ alarm }) => alarm.tag_id === tagId);
  const waiting = unacknowledged(items);
  const oldest = oldestOf(items);
  const since = useTicking((at) =>
    oldest ? spanText(oldest, rosNow(store.get(), at), selectKnownSince(store.get())) : '',
  );
  const well = useApp((state) =>
    worstNow(state, items) === 'healthy' ? todoNow(state, items) : '',
  );
  const { isAble, isRefused } = useActing();
  if (items.length === 0) return null;
  return (
    <div className="card-alarms" data-testid="card-alarms">
      <span>
        {waiting.length > 0 ? S.alarmCount(items.length) : <Acknowledged items={items} />} · {since}
        {well !== '' && ` · ${well}`}
      </span>
      {isAble && waiting.length > 0 && (
        <button
          type="button"
          disabled={isRefused}
          onClick={ignoreDoubleClick(() => acknowledgeAlarms(waiting))}
        >
          {waiting.length === 1
            ? S.alarmAcknowledge
            : S.alarmAll(S.alarmAcknowledge, waiting.length)}
        </button>
      )}
    </div>
  );
}

/** How many are acknowledged; for a single one, by whom and when. */
function Acknowledged({ items }: { items: readonly Item[] }): JSX.Element {
  const [only, ...others] = items.map(({ alarm }) => alarm);
  const who = useWhoAcknowledged(only && others.length === 0 ? only : null);
  return (
    <>{who === null ? S.alarmDone.acknowledge(items.length) : S.alarmWhat(S.alarmCount(1), who)}</>
  );
}

/** Shelved alarms: until when, why, and a button to unshelve. */
function Shelved({ tagId }: { tagId: string }): JSX.Element {
  const shelved = useSelected(alarmList, (list) => list.shelved);
  const sensors = useApp(selectCatalogue);
  const { isAble, isRefused } = useActing();
  return (
    <>
      {shelved.map(
        ({ alarm, shelf }) =>
          shelf &&
          alarm.tag_id === tagId && (
            <div key={alarm.id} className="card-alarms" data-testid="card-shelved">
              <span>
                {S.alarmWhat(
                  whatText(alarm, sensors),
                  S.alarmShelved(minuteText(shelf.until), shelf.reason, alarm.shelved_by ?? ''),
                )}
              </span>
              {isAble && (
                <button
                  type="button"
                  disabled={isRefused}
                  onClick={ignoreDoubleClick(() => unshelveAlarms([{ alarm }]))}
                >
                  {S.alarmUnshelve}
                </button>
              )}
            </div>
          ),
      )}
    </>
  );
}
