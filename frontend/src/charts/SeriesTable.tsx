import { type JSX, useState } from 'react';

import { ageText, readingText } from '../domain/format';
import type { Sensor, TemperatureUnit } from '../domain/sensors';
import { rowsOfSeries, type SeriesRow } from '../domain/series';
import { shown } from '../domain/text';
import { rosText } from '../domain/time';
import { S } from '../strings';
import { Select } from '../widgets/controls';
import { spanText } from './PlotView';
import type { Line, PlotModel } from './model';

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

/** The same as a line of a chart, for the keyboard and for screen readers; the newest row first. */
export function SeriesTable({ line, model }: { line: Line; model: PlotModel }): JSX.Element {
  const { series } = line;
  const { sensor, unit } = model;
  const isBucketed = series.bucketS !== null;
  const { chartColumns: columns } = S;
  const rows = rowsOfSeries(series, line.marks).reverse();
  return (
    // May scroll, so the keyboard must be able to reach it.
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
              <Values row={row} isBucketed={isBucketed} sensor={sensor} unit={unit} />
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
  unit,
}: {
  row: SeriesRow;
  isBucketed: boolean;
  sensor: Sensor;
  unit: TemperatureUnit;
}): JSX.Element {
  const value = (of: number): string => readingText(sensor, of, unit);
  switch (row.kind) {
    case 'reading':
      return (
        <>
          <td>{row.value === null ? S.sensorFailed : value(row.value)}</td>
          <td />
        </>
      );
    case 'bucket':
      return (
        <>
          <td>{rosText(row.to)}</td>
          <td>{row.n}</td>
          <td>{value(row.mean)}</td>
          <td>{value(row.min)}</td>
          <td>{value(row.max)}</td>
          <td />
        </>
      );
    case 'gap':
      return (
        <Event row={row} isBucketed={isBucketed} text={S.chartGap(ageText(row.to - row.at))} />
      );
    case 'not_kept':
    case 'not_recorded':
      return <Event row={row} isBucketed={isBucketed} text={S.missing[row.kind]} />;
    case 'failure':
      return <Event row={row} isBucketed={isBucketed} text={S.chartFailures(row.count)} />;
    case 'look':
      return <Event row={row} isBucketed={isBucketed} text={S.chartLooks(row.count)} />;
  }
}

/** What is no value: when it ended, and what it was. */
function Event({
  row,
  isBucketed,
  text,
}: {
  row: Extract<SeriesRow, { to: number }>;
  isBucketed: boolean;
  text: string;
}): JSX.Element {
  return (
    <>
      {isBucketed ? (
        <>
          <td>{rosText(row.to)}</td>
          <td colSpan={4} />
        </>
      ) : (
        <td />
      )}
      <td>{text}</td>
    </>
  );
}
