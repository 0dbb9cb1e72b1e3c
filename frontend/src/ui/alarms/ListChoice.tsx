import type { JSX } from 'react';

import { calling, countText } from '../../alarms/list';
import { worstNow } from '../../alarms/latest';
import { alarmList } from '../../alarms/watch';
import { act, useApp } from '../../store/app';
import { useSelected } from '../../store/create';
import { selectIsDisconnected } from '../../store/moment';
import { LONGEST_FILTER, withList } from '../../store/view';
import { S } from '../../strings';
import { Icon, Segmented } from '../../widgets/controls';
import { HealthShape } from '../HealthMark';
import { selectAreAlarmsKnown } from '../Reasons';

/** Element id of the alarm list, once it is loaded. */
export const ALARMS_ID = 'alarms';

/** Element id of the table's filter field, to move the focus there. */
export const FILTER_ID = 'tag-filter';

/** The field that filters a list. */
export function SearchField({
  label,
  value,
  onChange,
  ...rest
}: {
  id?: string;
  label: string;
  placeholder: string;
  value: string;
  onChange: (text: string) => void;
}): JSX.Element {
  return (
    <label className="search">
      <span className="unseen">{label}</span>
      <Icon name="search" size={18} />
      <input
        {...rest}
        type="search"
        value={value}
        autoComplete="off"
        spellCheck={false}
        maxLength={LONGEST_FILTER}
        onChange={(event) => onChange(event.target.value)}
        onKeyDown={(event) => {
          if (event.key !== 'Escape' || value === '') return;
          onChange('');
          // Handled here: it must not close charts or the tag card too.
          event.preventDefault();
        }}
      />
    </label>
  );
}

/** Saves a list as CSV. */
export const CsvButton = ({ title, save }: { title: string; save: () => void }): JSX.Element => (
  <button type="button" className="text-button" title={title} onClick={save}>
    <Icon name="download" size={18} /> <span className="csv-word">{S.saveCsvShort}</span>
  </button>
);

/** Chooses the list beside the map; a narrow screen has tabs at its foot instead. */
export function ListChoice(): JSX.Element {
  const list = useApp((state) => state.view.list);
  return (
    <Segmented
      className="list-choice"
      legend={S.listChoice}
      value={list}
      options={['tags', 'alarms'] as const}
      text={(each) => (each === 'tags' ? S.tags : <AlarmsLabel />)}
      onChange={(chosen) => act(withList(chosen))}
    />
  );
}

/**
 * "Alarms (7)": the number of active alarms, after the worst verdict's mark until all are acknowledged.
 * While a past moment is shown, it says that the number is of now, if that is known.
 */
export function AlarmsLabel(): JSX.Element {
  const list = useSelected(alarmList);
  const unacknowledged = calling(list);
  const count = countText(list, 'active');
  const hasAny = list.active.length > 0;
  const isKnown = useApp(selectAreAlarmsKnown);
  const isNow = useApp((state) => state.view.moment === null);
  const isDisconnected = useApp(selectIsDisconnected);
  const worst = useApp((state) =>
    unacknowledged.length === 0 ? null : worstNow(state, list.active),
  );
  if (isDisconnected && !isNow) return <>{S.alarms}</>;
  return (
    <>
      {worst && <HealthShape verdict={worst} />}
      <span>
        {S.alarms + (hasAny ? ' ' : '')}
        {hasAny && (
          <span data-testid="alarm-count" aria-hidden="true">
            ({isNow ? count : S.alarmsNow(count)})
          </span>
        )}
      </span>
      {isKnown && (hasAny || !isDisconnected) && (
        <span className="unseen">, {S.alarmsCount(unacknowledged.length, count)}</span>
      )}
    </>
  );
}
