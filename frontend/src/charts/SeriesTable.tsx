import type { JSX } from 'react';

import { ageText, readingText } from '../domain/format';
import { rosText } from '../domain/rostime';
import type { Sensor } from '../domain/sensors';
import { rowsOfSeries, type SeriesRow } from '../domain/series';
import { shown } from '../domain/text';
import type { TemperatureUnit } from '../domain/units';
import { S } from '../strings';
import type { Line, PlotModel } from './model';
import { spanText } from './told';

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
