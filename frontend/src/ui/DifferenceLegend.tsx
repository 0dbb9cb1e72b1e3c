import type { JSX } from 'react';

import { differenceText, divergingColours, signedText } from '../domain/difference';
import { rosText } from '../domain/time';
import { shown } from '../domain/text';
import { unitOf } from '../domain/format';
import { useApp } from '../store/app';
import { selectHeat, selectSensor } from '../store/derived';
import { S } from '../strings';

/** What the colours of the heat map mean while it is a difference; null: it is none. */
export function DifferenceLegend(): JSX.Element | null {
  const compare = useApp((state) => state.view.compare);
  const sensor = useApp(selectSensor);
  const unit = useApp((state) => state.settings.unit);
  const heat = useApp(selectHeat);
  const { value, state: fetched, message } = useApp((state) => state.twin.difference);
  if (!compare) return null;
  const range = heat?.difference ? heat.range : null;
  return (
    <div className="legend-difference" data-testid="difference-legend">
      <div className="legend-title">
        <strong>{S.difference(shown(sensor.label, 32))}</strong> <span>{unitOf(sensor, unit)}</span>
      </div>
      {range ? (
        <>
          <div
            className="difference-bar"
            aria-hidden="true"
            style={{
              backgroundImage: `linear-gradient(to right, ${divergingColours().join(', ')})`,
            }}
          />
          <div className="difference-ends">
            <span data-testid="difference-low">{signedText(sensor, range.low, unit)}</span>
            <span>{S.differenceNone}</span>
            <span data-testid="difference-high">{differenceText(sensor, range.high, unit)}</span>
          </div>
        </>
      ) : (
        <p role="status">
          {fetched === 'failed'
            ? S.differenceFailed(shown(message, 300))
            : value
              ? S.differenceNothing(rosText(Math.max(0, value.against)))
              : S.differenceLoading}
        </p>
      )}
      {range && value && (
        <p className="faint">{S.differenceTimes(rosText(value.at), rosText(value.against))}</p>
      )}
    </div>
  );
}
