import { useLayoutEffect, useRef, useState, type JSX } from 'react';

import { goToStart } from '../../alarms/follow';
import type { Item } from '../../alarms/list';
import { unacknowledgeAlarm, unshelveAlarm } from '../../alarms/own';
import { Field } from '../../notes/Comments';
import { C } from '../../notes/comments';
import { useApp } from '../../store/app';
import { mayAct, person, useSelected } from '../../store/create';
import { S } from '../../strings';
import { Disclosure, Icon, useClose } from '../../widgets/controls';
import { once } from './once';
import { Shelving } from './Shelving';

/** What else can be done to an alarm. */
export function RowMenu({ item, name }: { item: Item; name: string }): JSX.Element {
  return (
    <Disclosure label={S.alarmActionsOf(name)} button={<Icon name="dots" />} className="row-menu">
      <Actions item={item} name={name} />
    </Disclosure>
  );
}

function Actions({ item, name }: { item: Item; name: string }): JSX.Element {
  const { alarm, isAcknowledged, shelf } = item;
  const [form, setForm] = useState<'shelve' | 'comment' | null>(null);
  const close = useClose();
  const root = useRef<HTMLDivElement>(null);
  const who = useSelected(person, (it) => it);
  const canLookBack = useApp((state) => state.twin.remembered.state !== 'off');
  useLayoutEffect(() => {
    root.current?.scrollIntoView({ block: 'nearest' });
  }, [form]);
  const act = (text: string, action: () => void, isPossible = true): JSX.Element => (
    <li>
      <button type="button" disabled={!isPossible} onClick={once(action)}>
        {text}
      </button>
    </li>
  );
  const then = (action: (alarm: Item['alarm']) => void) => () => {
    close();
    action(alarm);
  };
  return (
    <div className="row-actions" ref={root}>
      {form === 'shelve' && <Shelving item={item} name={name} />}
      {form === 'comment' && <Field subject={`alarm:${alarm.id}`} moment={null} onDone={close} />}
      {form === null && (
        <ul className="menu-list">
          {act(S.alarmStart, then(goToStart), canLookBack)}
          {mayAct(who) && (
            <>
              {isAcknowledged && act(S.alarmUnacknowledge, then(unacknowledgeAlarm))}
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
