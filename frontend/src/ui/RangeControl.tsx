import type { JSX } from 'react';

import { type Range, rounded } from '../domain/ramp';
import { readingText } from '../domain/format';
import type { Sensor } from '../domain/sensors';
import { act, useApp } from '../store/app';
import { fixedRange } from '../store/view';
import { S } from '../strings';
import { Bound } from './Bound';
import { Segmented } from '../widgets/controls';

/** Automatic colours follow the data; a fixed range lets two moments be compared. */
export function RangeControl({
  sensor,
  range,
}: {
  sensor: Sensor;
  range: Range | null;
}): JSX.Element {
  const fixed = useApp((state) => fixedRange(state.view));
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
            refusal={(low) =>
              low < fixed.high ? null : S.rangeNotBelow(readingText(sensor, fixed.high, unit))
            }
            onChange={(low) => {
              act({ type: 'range', range: { ...fixed, low } });
            }}
          />
          <Bound
            label={S.rangeHigh}
            sensor={sensor}
            unit={unit}
            value={fixed.high}
            refusal={(high) =>
              high > fixed.low ? null : S.rangeNotAbove(readingText(sensor, fixed.low, unit))
            }
            onChange={(high) => {
              act({ type: 'range', range: { ...fixed, high } });
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
  if (range && range.high > range.low) return rounded(range);
  if (ideal) return { low: ideal[0], high: ideal[1] };
  return range ? { low: range.low - 1, high: range.high + 1 } : { low: 0, high: 1 };
}
