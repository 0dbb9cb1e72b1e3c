import type { JSX } from 'react';

import { valueAt } from '../domain/field';
import { metresText, readingText } from '../domain/format';
import { sensorNamed } from '../domain/sensors';
import { lengthText, scaleBar } from '../geometry/scale';
import { pointedAt } from '../map/pointer';
import { useApp } from '../store/app';
import { useSelected } from '../store/create';
import { selectShown } from '../store/moment';
import { S } from '../strings';

/** The field's value at the point that mouse or crosshair is on. */
export function Readout(): JSX.Element | null {
  const point = useSelected(pointedAt, (at) => at);
  const field = useApp((state) => selectShown(state).field.value);
  const name = useApp((state) => state.view.sensor);
  const unit = useApp((state) => state.settings.unit);
  if (!point) return null;
  const sensor = sensorNamed(name);
  const value = field?.sensor === name ? valueAt(field, point) : null;
  return (
    <output className="readout" data-testid="readout">
      <strong>{value === null ? S.notKnown : readingText(sensor, value, unit)}</strong>
      <span>{S.position(metresText(point.x), metresText(point.y))}</span>
    </output>
  );
}

const LONGEST_BAR_PX = 110;

/** A round length and how long it is on the map. */
export function ScaleBar(): JSX.Element {
  const scale = useApp((state) => state.viewport.view.scale);
  const bar = scaleBar(scale, LONGEST_BAR_PX);
  const length = lengthText(bar.metres);
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
