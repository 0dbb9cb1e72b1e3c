import type { JSX } from 'react';

import { readingText, valueText } from '../domain/format';
import { IDEAL_ALPHA, idealParts, idealsText } from '../domain/ideal';
import type { Sensor } from '../domain/sensors';
import { useApp } from '../store/app';
import { selectTags } from '../store/moment';
import { S } from '../strings';

/** What the colours mean while they tell how values lie against their ideal. */
export function IdealLegend({ sensor }: { sensor: Sensor }): JSX.Element {
  const unit = useApp((state) => state.settings.unit);
  const { ideal } = sensor;
  const colours = idealParts(IDEAL_ALPHA);
  const part = S.idealParts[sensor.part ?? 'any'];
  const species = useApp((state) => idealsText(sensor, selectTags(state), unit));
  // Of one range alone the limits stand beside the colours: each plant is coloured by its own.
  const low = species === '' && ideal && valueText(sensor, ideal[0], unit);
  const high = species === '' && ideal && readingText(sensor, ideal[1], unit);
  const step = (
    name: keyof typeof colours,
    word: string,
    limits: string | false | null,
  ): JSX.Element => (
    <div data-part={name}>
      <span
        className="ideal-bar"
        aria-hidden="true"
        style={{ backgroundImage: `linear-gradient(to right, ${colours[name].join(', ')})` }}
      />
      <strong>{word}</strong> {limits && <span>{limits}</span>}
    </div>
  );
  return (
    <div className="ideal-scale" data-testid="ideal-scale" title={species}>
      {step('low', S.tooLow(null), low ? S.legendBelow(low) : S.below)}
      {step('right', species === '' ? part : S.legendEach(part), low && high && `${low} – ${high}`)}
      {step('high', S.tooHigh(null), high ? S.legendAbove(high) : S.above)}
    </div>
  );
}
