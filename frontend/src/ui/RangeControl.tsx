import { useId, type JSX } from 'react';

import type { Range } from '../domain/ramp';
import type { Sensor } from '../domain/sensors';
import { fromShown, toShown, unitOf, type TemperatureUnit } from '../domain/units';
import { act, useApp } from '../store/app';
import { S } from '../strings';
import { Segmented } from './Segmented';

/** Automatic colours follow the data; a fixed range lets two moments be compared. */
export function RangeControl({
  sensor,
  range,
}: {
  sensor: Sensor;
  range: Range | null;
}): JSX.Element {
  const fixed = useApp((state) => state.view.range);
  const unit = useApp((state) => state.settings.unit);
  const { ideal } = sensor;
  return (
    <div className="range" data-fixed={fixed !== null}>
      <Segmented
        legend={S.range}
        value={fixed ? 'fixed' : 'auto'}
        options={[
          { value: 'auto', label: S.rangeAuto },
          { value: 'fixed', label: S.rangeFixed },
        ]}
        onChange={(mode) => {
          act({ type: 'range', range: mode === 'auto' ? null : startingRange(sensor, range) });
        }}
      />
      {fixed && (
        <>
          <Bound
            label={S.rangeLow}
            sensor={sensor}
            unit={unit}
            value={fixed.low}
            onChange={(low) => {
              if (low < fixed.high) act({ type: 'range', range: { ...fixed, low } });
            }}
          />
          <Bound
            label={S.rangeHigh}
            sensor={sensor}
            unit={unit}
            value={fixed.high}
            onChange={(high) => {
              if (high > fixed.low) act({ type: 'range', range: { ...fixed, high } });
            }}
          />
          {ideal && (
            <button
              type="button"
              className="text-button"
              onClick={() => {
                act({ type: 'range', range: { low: ideal[0], high: ideal[1] } });
              }}
            >
              {S.rangeIdeal}
            </button>
          )}
        </>
      )}
    </div>
  );
}

/** What is in use now, rounded outwards; without one, the ideal range. */
export function startingRange({ ideal }: Sensor, range: Range | null): Range {
  if (range && range.high > range.low) {
    const step = 10 ** Math.floor(Math.log10(range.high - range.low) - 0.5);
    const decimals = Math.max(0, -Math.floor(Math.log10(step)));
    const round = (value: number): number => Number(value.toFixed(decimals));
    return {
      low: round(Math.floor(range.low / step) * step),
      high: round(Math.ceil(range.high / step) * step),
    };
  }
  if (ideal) return { low: ideal[0], high: ideal[1] };
  return range ? { low: range.low - 1, high: range.high + 1 } : { low: 0, high: 1 };
}

function Bound({
  label,
  sensor,
  unit,
  value,
  onChange,
}: {
  label: string;
  sensor: Sensor;
  unit: TemperatureUnit;
  value: number;
  onChange: (value: number) => void;
}): JSX.Element {
  const id = useId();
  const text = String(Number(toShown(sensor, value, unit).toFixed(2)));
  return (
    <span className="bound">
      <label htmlFor={id}>
        {label}
        <span className="unseen"> {unitOf(sensor, unit)}</span>
      </label>
      <input
        id={id}
        // A new value from outside replaces what was being typed.
        key={text}
        type="number"
        step="any"
        defaultValue={text}
        onBlur={(event) => {
          const typed = event.target.valueAsNumber;
          if (Number.isFinite(typed)) onChange(fromShown(sensor, typed, unit));
        }}
        onKeyDown={(event) => {
          if (event.key === 'Enter') event.currentTarget.blur();
        }}
      />
    </span>
  );
}
