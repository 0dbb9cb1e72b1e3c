import type { JSX } from 'react';

import { DAY_S, differenceText, WEEK_S, type Compare } from '../domain/difference';
import { cellAt, valueAt } from '../domain/field';
import { metresText, readingText, written } from '../domain/format';
import { idealText, rangesAt } from '../domain/ideal';
import { rosText } from '../domain/time';
import { lengthText, scaleBar } from '../geometry/coordinates';
import { pointedAt } from '../map/commands';
import { useApp } from '../store/app';
import { useSelected } from '../store/create';
import { selectHeat, selectSensor, selectZones } from '../store/derived';
import { S } from '../strings';
import { EstimateReadout } from './estimate';

/** The field's value at the point that mouse or crosshair is on. */
export function Readout(): JSX.Element | null {
  const point = useSelected(pointedAt, (at) => at);
  const heat = useApp(selectHeat);
  const compare = useApp((state) => state.view.compare);
  const sensor = useApp(selectSensor);
  const unit = useApp((state) => state.settings.unit);
  const difference = heat?.difference;
  const value = point && heat?.field.sensor === sensor.name ? valueAt(heat.field, point) : null;
  const isOld = Boolean(point && heat?.old?.[cellAt(heat.field, point) ?? -1]);
  const ranges = useApp((state) => {
    if (!point || !heat || heat.difference || heat.isError) return null;
    const cell = cellAt(heat.field, point);
    return cell === null ? null : (rangesAt(selectZones(state, heat.field), cell) ?? null);
  });
  if (!point) return null;
  const how = value !== null && !isOld && ranges && idealText(sensor, ranges, value, unit);
  const text = difference ? differenceText : readingText;
  return (
    <output className="readout" data-testid="readout">
      {heat?.field.sureness ? (
        <EstimateReadout point={point} field={heat.field} value={value} isError={heat.isError} />
      ) : (
        <strong>
          {value === null ? S.notKnown : text(sensor, value, unit)}
          {difference && value !== null && (
            <span> {sinceText(rosText(difference.against), compare)}</span>
          )}
        </strong>
      )}
      {value !== null && isOld && <span data-testid="readout-old">{S.readoutOld}</span>}
      {how && <span data-testid="readout-ideal">{how}</span>}
      <span>{S.position(metresText(point.x), metresText(point.y))}</span>
    </output>
  );
}

/** What a difference is to; of a day or a week ago the time of day says it, if they are real ones. */
function sinceText(against: string, compare: Compare | null): string {
  const seconds = compare?.by === 'ago' ? compare.seconds : null;
  const clock = against.slice(-8, -3);
  if (seconds === DAY_S) return S.differenceSinceYesterday(clock);
  return seconds === WEEK_S ? S.differenceSinceWeek(clock) : S.differenceSince(against);
}

const LONGEST_BAR_PX = 110;

/** A round length and how long it is on the map. */
export function ScaleBar(): JSX.Element {
  const scale = useApp((state) => state.viewport.view.scale);
  const bar = scaleBar(scale, LONGEST_BAR_PX);
  const length = written(lengthText(bar.metres));
  return (
    // The view that is fitted keeps clear of the place, which must not depend on that view.
    <div className="scale-place" data-over-map>
      <div className="scale-bar" role="img" aria-label={S.scaleBar(length)}>
        <span className="bar" style={{ width: `${bar.pixels}px` }} />
        <span>{length}</span>
      </div>
    </div>
  );
}
