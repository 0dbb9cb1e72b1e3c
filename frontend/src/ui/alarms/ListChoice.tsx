import type { JSX } from 'react';

import { act, useApp } from '../../store/app';
import type { ViewState } from '../../store/view';
import { S } from '../../strings';
import { Segmented } from '../../widgets/controls';
import { AlarmsLabel } from './AlarmCount';

/** Of the list of alarms, once it is there. */
export const ALARMS_ID = 'alarms';

/** What stands beside the map; a narrow screen has tabs for it at its foot. */
export function ListChoice(): JSX.Element {
  const list = useApp((state) => state.view.list);
  return (
    <Segmented<ViewState['list']>
      className="list-choice"
      legend={S.listChoice}
      value={list}
      options={[
        { value: 'tags', label: S.tags },
        { value: 'alarms', label: <AlarmsLabel /> },
      ]}
      onChange={(chosen) => {
        act({ type: 'list', list: chosen });
      }}
    />
  );
}
