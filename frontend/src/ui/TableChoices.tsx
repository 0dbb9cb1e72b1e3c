import type { JSX } from 'react';

import { shown } from '../domain/text';
import { prefer, useApp } from '../store/app';
import { selectCatalogue, selectColumns } from '../store/derived';
import { selectTags } from '../store/moment';
import { isColumnShown, withColumn } from '../store/settings';
import { S } from '../strings';
import { Check } from '../widgets/controls';

/** Table settings: columns, and grouping by area. */
export function TableChoices(): JSX.Element {
  const sensors = useApp(selectColumns);
  const hidden = useApp((state) => state.settings.hidden);
  const isByArea = useApp((state) => state.settings.byArea);
  const hasAreas = useApp((state) => {
    const { areaOf } = selectCatalogue(state);
    return selectTags(state).some(({ id }) => areaOf(id) !== '');
  });
  const columns = [
    ['health', S.columns.health],
    ['age', S.columns.age],
    ...sensors.map(({ name, label }) => [name, shown(label, 24)] as const),
    ['trend', S.trend],
    ['species', S.columns.species],
    ['flowers', S.columns.flowers],
  ] as const;
  return (
    <>
      <fieldset className="columns">
        <legend>{S.tableColumns}</legend>
        {columns.map(([id, label]) => (
          <Check
            key={id}
            label={label}
            isOn={isColumnShown({ hidden }, id)}
            onChange={(isOn) => prefer({ hidden: withColumn(hidden, id, isOn) })}
          />
        ))}
      </fieldset>
      {hasAreas && (
        <Check
          label={S.tableByArea}
          isOn={isByArea}
          onChange={(isOn) => prefer({ byArea: isOn })}
        />
      )}
    </>
  );
}
