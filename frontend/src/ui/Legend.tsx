import { useMemo, type CSSProperties, type JSX, type ReactNode } from 'react';

import type { FieldQuality } from '../contract/types';
import { numberText, readingText, valueText } from '../domain/format';
import { fraction, rgbText, sensorColour, type Range } from '../domain/ramp';
import { RAMP, sensorNamed, type Sensor } from '../domain/sensors';
import { speciesLooks, UNKNOWN_SPECIES, type BloomLook } from '../domain/species';
import { shown } from '../domain/text';
import { differenceToShown, unitOf, type TemperatureUnit } from '../domain/units';
import { speciesOf } from '../draw/scene';
import { useApp } from '../store/app';
import { selectRange } from '../store/derived';
import { selectShown, selectTags } from '../store/moment';
import { S } from '../strings';
import { RangeControl } from './RangeControl';

export function Legend({ kiosk }: { kiosk: boolean }): JSX.Element {
  const name = useApp((state) => state.view.sensor);
  const unit = useApp((state) => state.settings.unit);
  const range = useApp(selectRange);
  const field = useApp((state) => selectShown(state).field.value);
  const quality = useApp((state) => selectShown(state).quality);
  const sensor = sensorNamed(name);
  const samples = field?.sensor === name ? field.sampleCount : 0;
  const isFetching = useApp(
    (state) =>
      selectShown(state).field.value?.sensor !== name &&
      selectTags(state).some((tag) => tag.at && tag.readings.get(name) != null),
  );
  return (
    <section className="legend" aria-label={S.legend} data-testid="legend">
      <div className="legend-scale">
        <div className="legend-title">
          <strong>{shown(sensor.label, 32)}</strong> <span>{unitOf(sensor, unit)}</span>
        </div>
        <Ramp sensor={sensor} range={range} unit={unit} />
      </div>
      <div className="legend-facts">
        <span data-testid="sample-count">
          {samples > 0 ? S.legendTags(samples) : isFetching ? S.legendFetching : S.legendNoTags}
        </span>
        {quality?.sensor_type === name && <Quality quality={quality} sensor={sensor} unit={unit} />}
        {/* One of the two is displayed. */}
        <span className="legend-note">{S.legendTransparent}</span>
        <span className="legend-note short">{S.legendTransparentShort}</span>
      </div>
      <Keys />
      {!kiosk && <RangeControl sensor={sensor} range={range} />}
    </section>
  );
}

/** How far off the field is where a tag could be guessed from the others. */
function Quality({
  quality,
  sensor,
  unit,
}: {
  quality: FieldQuality;
  sensor: Sensor;
  unit: TemperatureUnit;
}): JSX.Element | null {
  const { rmse, worst } = quality;
  if (rmse === null) return null;
  const error = (value: number): string =>
    `±${numberText(differenceToShown(sensor, Math.abs(value), unit))}\u00a0${unitOf(sensor, unit)}`;
  const atWorst = worst
    ? ` ${S.legendErrorWorst(shown(worst.tag_id, 24), error(worst.error))}`
    : '';
  return (
    <span title={S.legendErrorHint + atWorst} data-testid="rmse">
      {S.legendError(error(rmse))}
    </span>
  );
}

/** The colours of pins (above) and heat map (below) from the lowest to the highest value. */
function Ramp({
  sensor,
  range,
  unit,
}: {
  sensor: Sensor;
  range: Range | null;
  unit: TemperatureUnit;
}): JSX.Element {
  const colour = sensorColour(sensor);
  const ideal = range && sensor.ideal;
  const from = ideal && fraction(range, ideal[0]);
  const to = ideal && fraction(range, ideal[1]);
  const style = {
    '--ramp': rgbText(colour),
    '--ramp-field': rgbText(colour, RAMP.maxAlpha),
    '--ideal': ((from ?? 0) + (to ?? 1)) / 2,
  } as CSSProperties;
  return (
    <div className="ramp" style={style}>
      <div className="ramp-bar" aria-hidden="true">
        <span className="ramp-pins" />
        <span className="ramp-field" />
        {from !== null && to !== null && to > from && (
          <span
            className="ramp-ideal"
            style={{ left: `${from * 100}%`, width: `${(to - from) * 100}%` }}
          />
        )}
      </div>
      <div className="ramp-ends">
        <span data-testid="range-low">{range ? valueText(sensor, range.low, unit) : '–'}</span>
        <span className="ramp-before" />
        {sensor.ideal && (
          <span className="ramp-note">
            {S.legendIdeal(
              valueText(sensor, sensor.ideal[0], unit),
              valueText(sensor, sensor.ideal[1], unit),
            )}
          </span>
        )}
        <span data-testid="range-high">{range ? readingText(sensor, range.high, unit) : '–'}</span>
      </div>
    </div>
  );
}

/** What pins and dots mean. */
function Keys(): JSX.Element {
  const tags = useApp(selectTags);
  const species = useMemo(() => [...speciesLooks(speciesOf(tags))], [tags]);
  const unknown = tags.some((tag) => tag.blooms.some((bloom) => bloom.species === ''));
  return (
    // May scroll on a phone, so the keyboard must be able to reach it.
    // eslint-disable-next-line jsx-a11y/no-noninteractive-tabindex
    <ul className="legend-keys" aria-label={S.legend} tabIndex={0}>
      <li>
        <KeySign>
          <path d="M8 1.5 14.5 8 8 14.5 1.5 8Z" className="key-pin" />
        </KeySign>
        {S.pinValue}
      </li>
      <li>
        <KeySign>
          <path d="M8 1.5 14.5 8 8 14.5 1.5 8Z" className="key-pin hollow dashed" />
        </KeySign>
        {S.pinLacking}
      </li>
      <li>
        <KeySign>
          <path d="M8 1.5 14.5 8 8 14.5 1.5 8ZM5 11 11 5" className="key-pin failed" />
        </KeySign>
        {S.pinFailed}
      </li>
      <li>
        <KeySign>
          <circle cx="8" cy="8" r="6.2" className="key-pest" />
          <path d="M8 4.6v4M8 11v.01" className="key-pest-mark" />
        </KeySign>
        {S.pinPest}
      </li>
      {species.map(([name, look]) => (
        <li key={name}>
          <BloomKey look={look} />
          <bdi>{shown(name, 24)}</bdi>
        </li>
      ))}
      {unknown && (
        <li>
          <BloomKey look={UNKNOWN_SPECIES} />
          {S.legendUnknownSpecies}
        </li>
      )}
    </ul>
  );
}

function BloomKey({ look: { colour, shape } }: { look: BloomLook }): JSX.Element {
  return (
    <KeySign size={14}>
      <g className="key-bloom" fill={rgbText(colour)}>
        {shape === 'circle' && <circle cx="8" cy="8" r="5.5" />}
        {shape === 'square' && <path d="M3 3h10v10H3Z" />}
        {shape === 'triangle' && <path d="M8 1.500 14.500 13H1.500Z" />}
      </g>
    </KeySign>
  );
}

function KeySign({ size = 16, children }: { size?: number; children: ReactNode }): JSX.Element {
  return (
    <svg viewBox="0 0 16 16" width={size} height={size} aria-hidden="true">
      {children}
    </svg>
  );
}
