import { useState, type JSX } from 'react';

import type { Item } from '../../alarms/list';
import { acknowledgeAlarms } from '../../alarms/own';
import { alarmList } from '../../alarms/watch';
import { useSelected } from '../../store/create';
import { S } from '../../strings';
import { Disclosure } from '../../widgets/Disclosure';
import { Icon } from '../../widgets/Icon';
import { AlarmNotes } from './AlarmNotes';
import { AlarmRow, type GroupName } from './AlarmRow';
import { DoneLine } from './DoneLine';
import { ALARMS_ID, ListChoice } from './ListChoice';
import { once } from './once';
import { TellMe } from './TellMe';
import { useHeldOrder } from './useHeldOrder';
import { WhoseWord } from './WhoseWord';

/** Rows of one group at first, and so many more with each wish for more. */
const MOST_ROWS = 100;

/** The alarms of now, beside the map: active, shelved, and resolved. */
export function AlarmPanel(): JSX.Element {
  const list = useSelected(alarmList, (it) => it);
  const { active, shelved, resolved } = list;
  const unacknowledged = [...active, ...resolved].filter(({ isAcknowledged }) => !isAcknowledged);
  const hasAny = active.length + shelved.length > 0;
  const { shown, added, release, ...hold } = useHeldOrder(list);
  return (
    <>
      <div className="filter-bar">
        <ListChoice />
        <button
          type="button"
          className="text-button all-seen"
          disabled={unacknowledged.length === 0}
          onClick={once(() => {
            acknowledgeAlarms(unacknowledged);
          })}
        >
          <Icon name="check" size={18} /> {S.alarmAcknowledgeAll}
        </button>
        <Disclosure label={S.alarmTell} button={<Icon name="bell" />} className="tell-me">
          <TellMe />
        </Disclosure>
      </div>
      <DoneLine added={added.length} onShow={release} />
      <div
        className="alarms"
        id={ALARMS_ID}
        role="region"
        aria-label={S.alarms}
        // Scrolls by itself, so the keyboard must be able to reach it.
        // eslint-disable-next-line jsx-a11y/no-noninteractive-tabindex
        tabIndex={0}
        data-testid="alarms"
        {...hold}
      >
        <AlarmNotes isEmpty={!hasAny} />
        <Group name="active" items={shown.active} count={active.length} />
        <Group name="shelved" items={shown.shelved} count={shelved.length} />
        <Group name="resolved" items={shown.resolved} count={resolved.length} />
        {hasAny && <WhoseWord />}
      </div>
    </>
  );
}

function Group({
  name,
  items,
  count,
}: {
  name: GroupName;
  items: readonly Item[];
  /** As elsewhere in the page, whatever order is held. */
  count: number;
}): JSX.Element | null {
  const [most, setMost] = useState(MOST_ROWS);
  if (items.length === 0) return null;
  const rest = items.length - most;
  return (
    <section data-group={name}>
      <h3>{S.alarmGroups[name](count)}</h3>
      <ul>
        {items.slice(0, most).map((item) => (
          <AlarmRow key={item.alarm.id} item={item} group={name} />
        ))}
      </ul>
      {rest > 0 && (
        <button
          type="button"
          className="text-button"
          onClick={() => {
            setMost(most + MOST_ROWS);
          }}
        >
          {S.alarmMore(Math.min(rest, MOST_ROWS))}
        </button>
      )}
    </section>
  );
}
