import { Fragment, memo, type JSX, type ReactNode } from 'react';

import { trendOf } from '../domain/difference';
import { farOffText, percentText, shortAgeText, valueText } from '../domain/format';
import {
  beyondText,
  byCause,
  causeText,
  isBack,
  rangeReason,
  reasonsText,
  sideOf,
  worstReason,
} from '../domain/health';
import { speciesText } from '../domain/marks';
import type { Catalogue, Sensor } from '../domain/sensors';
import type { Row } from '../domain/table';
import { shown } from '../domain/text';
import type { When } from '../domain/time';
import { shortHourText, thenOf, type HourAgo } from '../store/hourAgo';
import { isColumnShown } from '../store/settings';
import { S } from '../strings';
import { Age, FailedAttemptText, useAgeStep } from './Age';
import { HealthMark } from './HealthMark';
import { Trend } from './Trend';

/** What all rows have in common. */
export interface RowLook {
  readonly catalogue: Catalogue;
  /** Sensors that have a column. */
  readonly sensors: readonly Sensor[];
  /** Those whose column is in sight: reasons do not repeat their values. */
  readonly beside: readonly string[];
  readonly chosen: string;
  /** Hidden columns. */
  readonly hidden: readonly string[];
  /** State an hour ago; null: unknown. */
  readonly then: HourAgo | null;
  /** Whether the twin has a valid time; otherwise nothing is assessed. */
  readonly isTimed: boolean;
}

interface Props extends Row {
  /** Position among all rows, from 0. */
  readonly index: number;
  readonly look: RowLook;
  /** Empty: in no area, or the area's heading says it. */
  readonly area: string;
  readonly selected: boolean;
  readonly hovered: boolean;
}

export const TagRow = memo(function TagRow(props: Props): JSX.Element {
  const { index, tag, health, look, area, selected, hovered } = props;
  const { catalogue, sensors, chosen, hidden } = look;
  const has = (id: string): boolean => isColumnShown({ hidden }, id);
  const all = reasonsText(catalogue, health.reasons);
  // Mention a failed scan once, with its age.
  const others = health.reasons.filter(({ kind }) => !tag.failedAttempt || kind !== 'scan_failed');
  const texts = byCause(others).map((reasons, place): ReactNode =>
    // The row's mark already gives the worst reason's verdict.
    causeText(catalogue, reasons, null, place === 0, look.beside),
  );
  if (tag.failedAttempt) {
    const attempt = (
      <span className="failed-attempt">
        <FailedAttemptText failed={tag.failedAttempt} />
      </span>
    );
    // The verdict's own reason comes first.
    if (worstReason(health)?.kind === 'scan_failed') texts.unshift(attempt);
    else texts.push(attempt);
  }
  const isUnranged = look.isTimed && health.verdict === 'unknown' && tag.readings.size > 0;
  const [why = isUnranged ? S.healthNoRange : undefined, ...more] = texts;
  return (
    <tr
      aria-rowindex={index + 2}
      data-tag-id={tag.id}
      data-health={health.verdict}
      data-pinned={tag.at !== null}
      data-pest={tag.anomaly}
      data-selected={selected}
      data-hovered={hovered}
    >
      <th scope="row">
        {/* The table (TagTable) handles clicks anywhere in the row, this button's too. */}
        <button type="button" className="row-button" aria-pressed={selected}>
          <bdi>{shown(tag.id, 24)}</bdi>
          {area !== '' && <small className="faint">{shown(area, 24)}</small>}
          {has('species') && tag.species !== '' && (
            <small className="row-species faint">{speciesText(tag.species, 28)}</small>
          )}
        </button>
        {!tag.at && (
          <span className="chip" title={tag.farOff ? farOffText(tag.farOff) : S.notOnMapLong}>
            {tag.farOff ? S.farOff : S.notOnMap}
          </span>
        )}
      </th>
      {has('health') && (
        <td className="cell-health" title={all}>
          <div>
            <HealthMark verdict={health.verdict} />
            {why !== undefined && (
              <>
                <span className="unseen">: </span>
                <span className="why">
                  {why}
                  {more.length > 0 && (
                    <>
                      <span className="why-count" data-count={more.length} />
                      <span className="why-more">
                        {more.map((text, place) => (
                          <Fragment key={place}>; {text}</Fragment>
                        ))}
                      </span>
                    </>
                  )}
                </span>
              </>
            )}
          </div>
        </td>
      )}
      {has('age') && (
        <td className="number cell-age">
          <Age when={tag.scannedAt} format={shortAgeText} />
        </td>
      )}
      {sensors.map((sensor) => (
        <td
          key={sensor.name}
          className={sensor.name === chosen ? 'number chosen' : 'number other'}
          data-sensor={sensor.name}
        >
          <TableReading sensor={sensor} row={props} look={look} />
          {sensor.name === chosen && has('trend') && (
            <TrendLine sensor={sensor} row={props} look={look} />
          )}
        </td>
      ))}
      {has('species') && (
        <td className="cell-species">
          {tag.species && <bdi>{speciesText(tag.species, 28)}</bdi>}
          {tag.species && tag.speciesConfidence !== null && (
            <span className="faint" title={S.confidence(percentText(tag.speciesConfidence))}>
              {percentText(tag.speciesConfidence)}
            </span>
          )}
        </td>
      )}
      {has('flowers') && (
        <td className="number optional">{tag.flowerCount > 0 ? tag.flowerCount : ''}</td>
      )}
    </tr>
  );
});

interface CellProps {
  readonly sensor: Sensor;
  readonly row: Row;
  readonly look: RowLook;
}

/** A value styled by its age; one older than the row's scan also shows its own age. */
function TableReading(cell: CellProps): JSX.Element {
  const { tag } = cell.row;
  const when = tag.readAt.get(cell.sensor.name) ?? 'never';
  const step = useAgeStep(when);
  return (
    <span className="reading" data-age={when === 'never' ? undefined : step}>
      <Reading {...cell} />
      {isOlder(when, tag.scannedAt) && (
        <span className="own-age">
          {' '}
          <Age when={when} format={shortAgeText} />
        </span>
      )}
    </span>
  );
}

/** Readings further apart than this come from different scans, seconds. */
const ONE_SCAN_S = 60;

const isOlder = (when: When, row: When): boolean =>
  when !== 'never' &&
  (typeof when === 'number' && typeof row === 'number' ? row - when > ONE_SCAN_S : when !== row);

function Reading({ sensor, row: { tag, health }, look }: CellProps): JSX.Element {
  const value = tag.readings.get(sensor.name);
  if (value === undefined) {
    // Blank, so that the readings stand out.
    return <span className="unseen">{S.pinLacking}</span>;
  }
  if (value === null) {
    return (
      <span className="failed" title={S.sensorFailedLong}>
        {S.sensorFailed}
      </span>
    );
  }
  const reason = rangeReason(health, sensor.name);
  const beyond = reason && !isBack(reason) ? beyondText(look.catalogue, reason) : null;
  return (
    <>
      {reason && beyond !== null && (
        <span className="beyond" data-health={reason.verdict} title={beyond}>
          <span aria-hidden="true">{S.side[sideOf(reason)]} </span>
          <span className="unseen">{beyond}: </span>
        </span>
      )}
      {valueText(sensor, value)}
    </>
  );
}

/** A reading's change over an hour: an arrow and the difference, or why there is none. */
function TrendLine({ sensor, row, look: { then } }: CellProps): JSX.Element | null {
  const { tag } = row;
  const value = tag.readings.get(sensor.name);
  const trend = trendOf(sensor.name, row, thenOf(then, tag));
  if (!trend || value == null) return null;
  if (!then || trend.kind !== 'by') {
    if (then && trend.kind === 'same')
      return (
        <span className="trend" data-trend="same" title={S.trendSame}>
          {S.trendSame}
        </span>
      );
    // For screen readers only: with a short history, every row would show it.
    return <span className="unseen">{then ? S.trendNone : S.trendUnknown}</span>;
  }
  return <Trend className="trend" sensor={sensor} by={trend.by} hour={shortHourText()} />;
}
