import { useId, useState, type JSX } from 'react';

import { fromShown, readingText, toShown } from '../domain/format';
import { rounded, type Range } from '../domain/ramp';
import type { Sensor } from '../domain/sensors';
import { act, useApp } from '../store/app';
import { fixedRange, withRange } from '../store/view';
import { S } from '../strings';
import { Segmented } from '../widgets/controls';

/** Chooses the colour range: automatic follows the data, fixed makes two moments comparable. */
export function RangeControl({
  sensor,
  range,
}: {
  sensor: Sensor;
  range: Range | null;
}): JSX.Element {
  const fixed = useApp((state) => fixedRange(state.view));
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
          act(withRange(mode === 'auto' ? null : startingRange(sensor, range)));
        }}
      />
      {fixed && (
        <>
          <Bound
            label={S.rangeLow}
            sensor={sensor}
            value={fixed.low}
            refusal={(low) =>
              low < fixed.high ? null : S.rangeNotBelow(readingText(sensor, fixed.high))
            }
            onChange={(low) => {
              act(withRange({ ...fixed, low }));
            }}
          />
          <Bound
            label={S.rangeHigh}
            sensor={sensor}
            value={fixed.high}
            refusal={(high) =>
              high > fixed.low ? null : S.rangeNotAbove(readingText(sensor, fixed.low))
            }
            onChange={(high) => {
              act(withRange({ ...fixed, high }));
            }}
          />
          {ideal && (
            <button
              type="button"
              className="text-button"
              onClick={() => {
                act(withRange({ low: ideal[0], high: ideal[1] }));
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

/** The range in use, rounded outwards; without one, the ideal range. */
export function startingRange({ ideal }: Sensor, range: Range | null): Range {
  if (range && range.high > range.low) return rounded(range);
  if (ideal) return { low: ideal[0], high: ideal[1] };
  return range ? { low: range.low - 1, high: range.high + 1 } : { low: 0, high: 1 };
}

/**
 * One end of a fixed range. Enter or leaving the field applies a valid input; an invalid one shows
 * the reason. After leaving, the field shows the applied value again: it never shows a number that
 * the map does not use.
 */
export function Bound({
  label,
  sensor,
  value,
  refusal,
  onChange,
}: {
  label: string;
  sensor: Sensor;
  /** The applied value; like all values here, in the sensor's unit. */
  value: number;
  /** Why a value is invalid; null: it is valid. */
  refusal: (value: number) => string | null;
  onChange: (value: number) => void;
}): JSX.Element {
  const id = useId();
  const text = String(Number(toShown(sensor, value).toPrecision(7)));
  // null: nothing typed since the last applied value.
  const [typed, setTyped] = useState<string | null>(null);
  const wanted = typed === null || typed.trim() === '' ? NaN : Number(typed);
  const next = fromShown(sensor, wanted);
  const why = typed === null ? null : Number.isFinite(next) ? refusal(next) : S.rangeNoNumber;

  const apply = (): void => {
    if (typed !== null && why === null && typed !== text) onChange(next);
  };
  return (
    <span className="bound">
      <label htmlFor={id}>
        {label}
        <span className="unseen"> {sensor.unit}</span>
      </label>
      <input
        id={id}
        type="number"
        step="any"
        value={typed ?? text}
        aria-invalid={why !== null}
        aria-describedby={why === null ? undefined : `${id}-why`}
        onChange={(event) => {
          setTyped(event.target.value);
        }}
        onBlur={() => {
          apply();
          setTyped(null);
        }}
        onKeyDown={(event) => {
          if (event.key === 'Enter' && why === null) {
            apply();
            setTyped(null);
          }
          if (event.key === 'Escape' && typed !== null) {
            setTyped(null);
            // Handled here: it must not close the tag card too.
            event.preventDefault();
          }
        }}
      />
      {why !== null && (
        <span className="bound-why" id={`${id}-why`} role="alert">
          {why}
        </span>
      )}
    </span>
  );
}
