import type { JSX } from 'react';

import { errorColours, NINE_OF_TEN } from '../domain/sureness';
import { useApp } from '../store/app';
import { selectHeat, selectSensor } from '../store/derived';
import { errorText } from './texts';
import { E } from './words';

/** The colours of the error alone. */
export function ErrorScale(): JSX.Element {
  const sensor = useApp(selectSensor);
  const unit = useApp((state) => state.settings.unit);
  const most = useApp((state) => selectHeat(state)?.range.high ?? 0);
  return (
    <div data-testid="error-scale">
      <div
        className="difference-bar"
        aria-hidden="true"
        style={{ backgroundImage: `linear-gradient(to right, ${errorColours().join(', ')})` }}
      />
      <div className="difference-ends">
        <span>±{'\u00a0'}0</span>
        <strong>{E.error}</strong>
        <span data-testid="error-high">
          ±{'\u00a0'}
          {errorText(sensor, most / NINE_OF_TEN, unit)}
        </span>
      </div>
    </div>
  );
}
