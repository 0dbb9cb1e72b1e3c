import { useId, useState, type JSX } from 'react';

import type { Sensor } from '../domain/sensors';
import { fromShown, type TemperatureUnit, toShown, unitOf } from '../domain/format';
import { S } from '../strings';

/**
 * One end of a fixed range. What is typed comes into force with Enter or on leaving, if it can;
 * until then the field says why it cannot. On leaving it shows what is in force again: a number
 * on display that the map does not follow would be a lie.
 */
export function Bound({
  label,
  sensor,
  unit,
  value,
  refusal,
  onChange,
}: {
  label: string;
  sensor: Sensor;
  unit: TemperatureUnit;
  /** In force now, in the sensor's unit, and so are all values here. */
  value: number;
  /** Why a value cannot be; null: it can. */
  refusal: (value: number) => string | null;
  onChange: (value: number) => void;
}): JSX.Element {
  const id = useId();
  const text = String(Number(toShown(sensor, value, unit).toFixed(2)));
  // null: nothing has been typed since the last value came into force.
  const [typed, setTyped] = useState<string | null>(null);
  const wanted = typed === null || typed.trim() === '' ? NaN : Number(typed);
  const next = fromShown(sensor, wanted, unit);
  const why = typed === null ? null : Number.isFinite(next) ? refusal(next) : S.rangeNoNumber;

  const apply = (): void => {
    if (typed !== null && why === null && typed !== text) onChange(next);
  };
  return (
    <span className="bound">
      <label htmlFor={id}>
        {label}
        <span className="unseen"> {unitOf(sensor, unit)}</span>
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
            // It has been of use here, and is not to close the tag's card too.
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
