import type { JSX } from 'react';

import { differenceText, divergingColours, signedText } from '../domain/difference';
import { shown } from '../domain/text';
import { rosText, shortRosText } from '../domain/time';
import { act, useApp } from '../store/app';
import { selectHeat, selectSensor } from '../store/derived';
import { S } from '../strings';
import { Select } from '../widgets/controls';

const CHOICES = ['none', 'day', 'week'] as const;

/** What the heat map is compared with: the same hour of another day. */
export function CompareControl(): JSX.Element {
  const compare = useApp((state) => state.view.compare);
  return (
    <label className="compare layer-choice">
      <span>{S.compare}</span>
      <Select
        value={compare ?? 'none'}
        data-testid="compare"
        options={CHOICES}
        text={(choice) => S.compareWith[choice]}
        onChange={(choice) => act({ compare: choice === 'none' ? null : choice })}
      />
    </label>
  );
}

/** Legend of the heat map while it shows a difference; null: it shows none. */
export function DifferenceLegend({ kiosk }: { kiosk: boolean }): JSX.Element | null {
  const compare = useApp((state) => state.view.compare);
  const sensor = useApp(selectSensor);
  const heat = useApp(selectHeat);
  const { value, state: fetched, message } = useApp((state) => state.twin.difference);
  if (!compare) return null;
  const range = heat?.difference ? heat.range : null;
  return (
    <div className="legend-difference" data-testid="difference-legend">
      <div className="legend-title">
        <strong>{S.difference(shown(sensor.label, 32))}</strong>{' '}
        {!kiosk && (
          <button
            type="button"
            className="text-button"
            onClick={() => {
              // The focus must not go with the button: to the menu of the comparison.
              document.querySelector<HTMLElement>('.layers > button')?.focus();
              act({ compare: null });
            }}
          >
            {S.compareEnd}
          </button>
        )}
      </div>
      {range ? (
        <div className="difference-scale">
          <span>{signedText(sensor, range.low)}</span>
          <div
            className="difference-bar"
            aria-hidden="true"
            style={{
              backgroundImage: `linear-gradient(to right, ${divergingColours().join(', ')})`,
            }}
          />
          <span>{differenceText(sensor, range.high)}</span>
        </div>
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
        <p className="faint">
          {S.differenceTimes(shortRosText(value.at), shortRosText(value.against))}
        </p>
      )}
    </div>
  );
}
