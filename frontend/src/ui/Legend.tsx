import type { CSSProperties, JSX } from 'react';

import type { FieldQuality } from '../contract/types';
import { differenceNumber, rangeText, readingText, valueText, withUnit } from '../domain/format';
import { IDEAL_ALPHA, idealParts, idealsText } from '../domain/ideal';
import { fraction, rgbText, sensorColour, type Range } from '../domain/ramp';
import type { Sensor } from '../domain/sensors';
import { shown } from '../domain/text';
import { act, useApp } from '../store/app';
import {
  selectColouring,
  selectHasIdeal,
  selectHeat,
  selectRange,
  selectSensor,
} from '../store/derived';
import { selectHasSnapshot, selectShown, selectTags } from '../store/moment';
import { HEATS } from '../store/view';
import { S } from '../strings';
import { Check, Segmented, Select } from '../widgets/controls';
import { ErrorScale, EstimateFacts } from './lazyParts';
import { WithParts } from './loadDeferred';
import { SensorLabel } from './SensorPicker';

export function Legend({ kiosk }: { kiosk: boolean }): JSX.Element {
  const sensor = useApp(selectSensor);
  const { name } = sensor;
  const range = useApp(selectRange);
  const field = useApp((state) => selectShown(state).field.value);
  const quality = useApp((state) => selectShown(state).quality);
  const samples = field?.sensor === name ? field.sampleCount : 0;
  const isFetching = useApp(
    (state) =>
      (!selectHasSnapshot(state) && !state.twin.pastFault) ||
      (selectShown(state).field.value?.sensor !== name &&
        selectTags(state).some((tag) => tag.at && tag.readings.get(name) != null)),
  );
  const isCompared = useApp((state) => state.view.compare !== null);
  const isIdealChosen = useApp((state) => state.view.colouring === 'ideal');
  const hasIdeal = useApp(selectHasIdeal);
  const isKept = useApp((state) => state.view.kept?.sensor === name);
  const isIdeal = useApp((state) => selectColouring(state) === 'ideal');
  const isEstimate = useApp((state) => state.view.heat !== 'nearest');
  const isError = useApp((state) => selectHeat(state)?.isError ?? false);
  const ideals = useApp((state) => idealsText(sensor, selectTags(state)));
  const isOld = useApp((state) => Boolean(selectHeat(state)?.old));
  const fetched = useApp((state) => state.twin.sensors);
  if (!fetched.value) {
    return (
      <section className="legend" aria-label={S.legend} data-testid="legend">
        <p role="status">
          {fetched.state === 'failed'
            ? S.legendFailed(shown(fetched.message, 300))
            : S.legendWaiting}
        </p>
      </section>
    );
  }
  return (
    <section className="legend" aria-label={S.legend} data-testid="legend">
      {!isCompared && (
        <>
          <div className="legend-title">
            <strong>
              <SensorLabel sensor={sensor} most={20} />
            </strong>{' '}
            <span>{sensor.unit}</span>
          </div>
          <div className="legend-scale">
            {isError ? (
              <ErrorScale />
            ) : isIdeal ? (
              <IdealLegend sensor={sensor} />
            ) : (
              <Ramp sensor={sensor} range={range} />
            )}
          </div>
        </>
      )}
      <WithParts>{(parts) => <parts.DifferenceLegend kiosk={kiosk} />}</WithParts>
      {isOld && (
        <span className="legend-old" data-testid="legend-old">
          <HatchedSign isFaint /> {S.legendOld}
        </span>
      )}
      {isIdealChosen && !hasIdeal && !isCompared && (
        <span className="faint" data-testid="no-ideal">
          {S.legendNoIdeal}
        </span>
      )}
      {isEstimate && (
        <div className="legend-facts">
          <EstimateFacts />
        </div>
      )}
      <details className="legend-more" open={kiosk}>
        <summary>{S.legendMore}</summary>
        <div className="legend-facts">
          {!kiosk && !isError && !isCompared && (
            <div className="legend-controls">
              {hasIdeal && <ColouringControl />}
              {!isIdeal && range && (
                <Check
                  label={S.rangeKeep}
                  isOn={isKept}
                  onChange={(isOn) => {
                    act({ kept: isOn ? { ...range, sensor: name } : null });
                  }}
                />
              )}
            </div>
          )}
          <span data-testid="sample-count">
            {samples > 0 ? S.legendTags(samples) : isFetching ? S.legendFetching : S.legendNoTags}
          </span>
          {!isEstimate && !isCompared && quality?.sensor_type === name && (
            <Quality quality={quality} sensor={sensor} />
          )}
          {isIdeal && !isError && !isCompared && ideals !== '' && (
            <span data-testid="ideal-species">{ideals}</span>
          )}
          {!isEstimate && (
            <span className="legend-note">
              {!isIdeal && `${S.legendTransparent} `}
              <HatchedSign /> {S.legendHatched}
            </span>
          )}
          <WithParts>{(parts) => <parts.InLegend />}</WithParts>
        </div>
      </details>
    </section>
  );
}

/** The map's hatching for unknown areas; faintly coloured, for areas with only old values. */
function HatchedSign({ isFaint = false }: { isFaint?: boolean }): JSX.Element {
  return (
    <svg viewBox="0 0 16 12" width="20" height="12" aria-hidden="true" className="key-hatched">
      {isFaint && <rect width="16" height="12" className="key-faint" />}
      <path d="M-2 8 6 0M0 14 14 0M8 14 18 4" />
    </svg>
  );
}

/** The field's leave-one-out error: each tag is predicted from the others. */
function Quality({
  quality,
  sensor,
}: {
  quality: FieldQuality;
  sensor: Sensor;
}): JSX.Element | null {
  const { rmse } = quality;
  if (rmse === null) return null;
  return (
    <span title={S.legendErrorHint} data-testid="rmse">
      {S.legendError(withUnit(sensor, differenceNumber(sensor, Math.abs(rmse))))}
    </span>
  );
}

/** The heat map's colours, from the lowest to the highest value. */
function Ramp({ sensor, range }: { sensor: Sensor; range: Range | null }): JSX.Element {
  const colour = sensorColour(sensor);
  const ideal = range && sensor.ideal;
  const from = ideal && fraction(range, ideal[0]);
  const to = ideal && fraction(range, ideal[1]);
  const low = range ? valueText(sensor, range.low) : '–';
  const high = range ? readingText(sensor, range.high) : '–';
  const style = {
    '--ramp-field': rgbText(colour, sensor.maxAlpha),
    '--ideal': ((from ?? 0) + (to ?? 1)) / 2,
  } as CSSProperties;
  return (
    <div className="ramp" style={style}>
      <div className="ramp-bar" aria-hidden="true">
        <span className="ramp-field" />
        {from !== null && to !== null && to > from && (
          <span
            className="ramp-ideal"
            style={{ left: `${from * 100}%`, width: `${(to - from) * 100}%` }}
          />
        )}
      </div>
      <div className="ramp-ends">
        <span data-testid="range-low">{low}</span>
        <span className="ramp-before" />
        {sensor.ideal && (
          <span className="ramp-note">
            {S.idealParts[sensor.part ?? 'any']} {rangeText(sensor, sensor.ideal)}
          </span>
        )}
        <span data-testid="range-high">{high}</span>
      </div>
    </div>
  );
}

/** Legend of the colours that compare values with their ideal range. */
function IdealLegend({ sensor }: { sensor: Sensor }): JSX.Element {
  const { ideal } = sensor;
  const colours = idealParts(IDEAL_ALPHA);
  const part = S.idealParts[sensor.part ?? 'any'];
  const species = useApp((state) => idealsText(sensor, selectTags(state)));
  // Limits are shown for a single range only: with several species, each plant uses its own.
  const low = species === '' && ideal && valueText(sensor, ideal[0]);
  const high = species === '' && ideal && readingText(sensor, ideal[1]);
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
      {word && <strong>{word} </strong>}
      {limits && <span>{limits}</span>}
    </div>
  );
  return (
    <div className="ideal-scale" data-testid="ideal-scale" title={species}>
      {step('low', low ? S.tooLow(null) : '', low ? S.legendBelow(low) : S.tooLow(null))}
      {step(
        'right',
        species === '' ? part : S.legendEach(part),
        species === '' && ideal && rangeText(sensor, ideal),
      )}
      {step('high', high ? S.tooHigh(null) : '', high ? S.legendAbove(high) : S.tooHigh(null))}
    </div>
  );
}

/** Chooses how the heat map is computed; part of the permalink. */
export function HeatControl(): JSX.Element {
  const heat = useApp((state) => state.view.heat);
  return (
    <Select
      aria-label={S.heat}
      data-testid="heat"
      value={heat}
      options={HEATS}
      text={(kind) => S.heats[kind]}
      onChange={(chosen) => {
        act({ heat: chosen });
      }}
    />
  );
}

/** Chooses how the heat map is coloured; part of the permalink. */
function ColouringControl(): JSX.Element {
  const colouring = useApp((state) => state.view.colouring);
  return (
    <>
      <span aria-hidden="true">{S.colouring}</span>
      <Segmented
        legend={S.colouring}
        className="colouring"
        value={colouring}
        options={['ideal', 'value'] as const}
        text={(each) => S.colourings[each]}
        onChange={(chosen) => act({ colouring: chosen })}
      />
    </>
  );
}
