/** A field of an estimate as it came: what is too unsure is not known. Pure. */
import type { Estimate } from '../contract/estimate';
import type { Field } from '../contract/types';
import { rangeOf } from './ramp';
import { NOT_KNOWN_STEP, stepOf } from './sureness';

export function estimatedField(sensor: string, estimate: Estimate): Field {
  const { mean, sd, sdKnown, readingCount, ...grid } = estimate;
  const values = mean.map((value, cell) =>
    stepOf(sd[cell] ?? NaN, sdKnown) < NOT_KNOWN_STEP ? value : NaN,
  );
  const known = rangeOf(values);
  const { width, height, originX, originY, resolution, sampleCount } = grid;
  return {
    sensor,
    width,
    height,
    originX,
    originY,
    resolution,
    valueMin: known?.low ?? 0,
    valueMax: known?.high ?? 0,
    sampleCount,
    values,
    sureness: { sd, sdKnown, readingCount },
  };
}
