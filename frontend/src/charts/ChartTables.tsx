import { useState, type JSX } from 'react';

import { shown } from '../domain/text';
import { S } from '../strings';
import { Select } from '../widgets/Select';
import type { PlotModel } from './model';
import { SeriesTable } from './SeriesTable';

/** The table of one line, and the choice among them. */
export function ChartTables({ models }: { models: readonly PlotModel[] }): JSX.Element | null {
  const lines = models.flatMap((model) =>
    model.lines.map((line) => ({
      model,
      line,
      key: `${model.sensor.name}\u0000${line.series.tagId}`,
      label: `${line.label}, ${shown(model.sensor.label, 32)}`,
    })),
  );
  const [chosen, setChosen] = useState('');
  const current = lines.find(({ key }) => key === chosen) ?? lines[0];
  if (!current) return null;
  return (
    <>
      {lines.length > 1 && (
        <label className="chart-which">
          <span>{S.chartWhich}</span>
          <Select
            value={current.key}
            options={lines.map(({ key }) => key)}
            text={(key) => lines.find((line) => line.key === key)?.label ?? ''}
            onChange={setChosen}
          />
        </label>
      )}
      <SeriesTable line={current.line} model={current.model} />
    </>
  );
}
