import { useState, type JSX } from 'react';

import type { Item } from '../../alarms/list';
import { seeAlarms } from '../../alarms/own';
import { alarmList } from '../../alarms/watch';
import { useSelected } from '../../store/create';
import { S } from '../../strings';
import { Disclosure } from '../../widgets/Disclosure';
import { Icon } from '../../widgets/Icon';
import { AlarmNotes } from './AlarmNotes';
import { AlarmRow } from './AlarmRow';
import { ALARMS_ID, ListChoice } from './ListChoice';
import { TellMe } from './TellMe';

/** Rows of one group at first, and so many more with each wish for more. */
const MOST_ROWS = 100;

/** The alarms of now, beside the map: active, put aside, and what is over. */
export function AlarmPanel(): JSX.Element {
  const { active, shelved, over } = useSelected(alarmList, (list) => list);
  const unseen = [...active, ...over].filter(({ isSeen }) => !isSeen);
  const hasAny = active.length + shelved.length > 0;
  return (
    <>
      <div className="filter-bar">
        <ListChoice />
        <button
          type="button"
          className="text-button all-seen"
          disabled={unseen.length === 0}
          onClick={() => {
            seeAlarms(unseen);
          }}
        >
          <Icon name="check" size={18} /> {S.alarmAllSeen}
        </button>
        <Disclosure label={S.alarmTell} button={<Icon name="bell" />} className="tell-me">
          <TellMe />
        </Disclosure>
      </div>
      <div
        className="alarms"
        id={ALARMS_ID}
        role="region"
        aria-label={S.alarms}
        // Scrolls by itself, so the keyboard must be able to reach it.
        // eslint-disable-next-line jsx-a11y/no-noninteractive-tabindex
        tabIndex={0}
        data-testid="alarms"
      >
        <AlarmNotes isEmpty={!hasAny} />
        <Group name="active" items={active} />
        <Group name="shelved" items={shelved} />
        <Group name="over" items={over} />
        {hasAny && <p className="alarms-mine faint">{S.alarmsMine}</p>}
      </div>
    </>
  );
}

function Group({
  name,
  items,
}: {
  name: 'active' | 'shelved' | 'over';
  items: readonly Item[];
}): JSX.Element | null {
  const [most, setMost] = useState(MOST_ROWS);
  if (items.length === 0) return null;
  const rest = items.length - most;
  return (
    <section data-group={name}>
      <h3>{S.alarmGroups[name](items.length)}</h3>
      <ul>
        {items.slice(0, most).map((item) => (
          <AlarmRow key={item.alarm.id} item={item} />
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
