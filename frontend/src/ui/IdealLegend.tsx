import type { JSX } from 'react';

import { readingText, valueText } from '../domain/format';
import { IDEAL_ALPHA, idealParts } from '../domain/ideal';
import { rangesFor, type Sensor } from '../domain/sensors';
import { speciesText } from '../domain/species';
import { useApp } from '../store/app';
import { selectTags } from '../store/moment';
import { S } from '../strings';

/** What the colours mean while they tell how values lie against their ideal. */
export function IdealLegend({ sensor }: { sensor: Sensor }): JSX.Element {
  const unit = useApp((state) => state.settings.unit);
  const { ideal } = sensor;
  const colours = idealParts(IDEAL_ALPHA);
  const part = S.idealParts[sensor.part ?? 'any'];
  const low = ideal && valueText(sensor, ideal[0], unit);
  const high = ideal && readingText(sensor, ideal[1], unit);
  const step = (name: keyof typeof colours, word: string, limits: string | null): JSX.Element => (
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
    <div className="ideal-scale" data-testid="ideal-scale">
      {step('low', S.tooLow(null), low && S.legendBelow(low))}
      {step('right', part, low && high && `${low} – ${high}`)}
      {step('high', S.tooHigh(null), high && S.legendAbove(high))}
    </div>
  );
}

/** The ideal of the species in the greenhouse that have one of their own. */
export function IdealOfSpecies({ sensor }: { sensor: Sensor }): JSX.Element | null {
  const unit = useApp((state) => state.settings.unit);
  // As one text: the same for the same.
  const own = useApp((state) =>
    [...new Set(selectTags(state).map(({ sureSpecies }) => sureSpecies.toLowerCase()))]
      .filter((species) => sensor.species.has(species))
      .sort()
      .join('\u0000'),
  );
  if (own === '') return null;
  const texts = own.split('\u0000').map((species) => {
    const range = rangesFor(sensor, species).ideal;
    const limits = range
      ? `${valueText(sensor, range[0], unit)} – ${readingText(sensor, range[1], unit)}`
      : '–';
    return `${speciesText(species, 24)} ${limits}`;
  });
  return <span data-testid="ideal-species">{texts.join('; ')}</span>;
}
