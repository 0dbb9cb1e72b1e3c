import { type JSX, useState } from 'react';

import { ageText, readingText } from '../domain/format';
import type { Sensor } from '../domain/sensors';
import { rowsOfSeries, type SeriesRow } from '../domain/series';
import { shown } from '../domain/text';
import { rosText } from '../domain/time';
import { S } from '../strings';
import { Select } from '../widgets/controls';
import { spanText } from './PlotView';
import type { Line, PlotModel } from './model';

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

/** A chart's line as a table, for keyboard and screen readers; the latest row first. */
function SeriesTable({ line, model }: { line: Line; model: PlotModel }): JSX.Element {
  const { series } = line;
  const { sensor } = model;
  const isBucketed = series.bucketS !== null;
  const { chartColumns: columns } = S;
  const rows = rowsOfSeries(series, line.marks).reverse();
  return (
    // It may scroll, so the keyboard must reach it.
    // eslint-disable-next-line jsx-a11y/no-noninteractive-tabindex
    <div className="series-scroll" tabIndex={0}>
      <table className="series-table" data-testid="series-table">
        <caption>
          {line.label}, {shown(sensor.label, 32)}, {spanText(series)}
        </caption>
        <thead>
          <tr>
            <th scope="col">{columns.time}</th>
            {isBucketed ? (
              <>
                <th scope="col">{columns.until}</th>
                <th scope="col">{columns.count}</th>
                <th scope="col">{columns.mean}</th>
                <th scope="col">{columns.min}</th>
                <th scope="col">{columns.max}</th>
              </>
            ) : (
              <th scope="col">{columns.value}</th>
            )}
            <th scope="col">{columns.event}</th>
          </tr>
        </thead>
        <tbody>
          {rows.map((row, index) => (
            <tr key={`${row.kind}${row.at}.${index}`} data-kind={row.kind} data-at={row.at}>
              <th scope="row">{rosText(row.at)}</th>
              <Values row={row} isBucketed={isBucketed} sensor={sensor} />
            </tr>
          ))}
          {rows.length === 0 && (
            <tr>
              <td colSpan={isBucketed ? 7 : 3}>{S.chartEmpty}</td>
            </tr>
          )}
        </tbody>
      </table>
    </div>
  );
}

function Values({
  row,
  isBucketed,
  sensor,
}: {
  row: SeriesRow;
  isBucketed: boolean;
  sensor: Sensor;
}): JSX.Element {
  const value = (of: number | null): JSX.Element => (
    <td>{of === null ? S.sensorFailed : readingText(sensor, of)}</td>
  );
  const event = eventText(row);
  return (
    <>
      {isBucketed && <td>{row.to !== null && rosText(row.to)}</td>}
      {row.kind === 'bucket' && <td>{row.n}</td>}
      {event === '' ? value(row.value) : <td colSpan={isBucketed ? 4 : 1} />}
      {row.kind === 'bucket' && (
        <>
          {value(row.min)}
          {value(row.max)}
        </>
      )}
      <td>{event}</td>
    </>
  );
}

/** A row that is no value, in words; empty: it is one. */
function eventText({ kind, at, to, n }: SeriesRow): string {
  switch (kind) {
    case 'reading':
    case 'bucket':
      return '';
    case 'gap':
      return S.chartGap(ageText((to ?? at) - at));
    case 'not_kept':
    case 'not_recorded':
      return S.missing[kind];
    case 'failure':
      return S.chartFailures(n ?? 0);
    case 'inspection':
      return S.chartInspections(n ?? 0);
  }
}
