/** What follows from the state; each remembers its last answer, so that it is worked out once. */
import { houseHealth } from '../domain/health';
import { rangeOf, type Range } from '../domain/ramp';
import { sensorsIn, type Sensor } from '../domain/sensors';
import type { Snapshot } from '../domain/twin';
import type { AppState } from './app';
import { fixedRange } from './view';

/** The same function, but the same arguments as last time give the same object back. */
export function memoLast<Args extends readonly unknown[], Result>(
  compute: (...args: Args) => Result,
): (...args: Args) => Result {
  let last: { readonly args: Args; readonly result: Result } | null = null;
  return (...args) => {
    const hit = last?.args.every((arg, index) => Object.is(arg, args[index]));
    if (last && hit) return last.result;
    const result = compute(...args);
    last = { args, result };
    return result;
  };
}

const healthOfTags = memoLast((snapshot: Snapshot | null) => houseHealth(snapshot?.tags ?? []));

export const selectHealth = (state: AppState): ReturnType<typeof houseHealth> =>
  healthOfTags(state.twin.snapshot);

const sensorNames = memoLast(
  // The names as one string: a new snapshot with the same sensors keeps the same list.
  (joined: string): readonly Sensor[] => sensorsIn(joined === '' ? [] : joined.split('\u0000')),
);

export const selectSensors = ({ twin, view }: AppState): readonly Sensor[] => {
  const names = new Set(twin.snapshot?.tags.flatMap((tag) => [...tag.readings.keys()]));
  if (view.sensor) names.add(view.sensor);
  return sensorNames([...names].sort().join('\u0000'));
};

const range = memoLast((low: number, high: number): Range => ({ low, high }));

/** The range of the colours in use: the fixed one, else the field's, else the readings'. */
export function selectRange({ twin, view }: AppState): Range | null {
  const fixed = fixedRange(view);
  if (fixed) return fixed;
  const field = twin.field.value;
  if (field?.sensor === view.sensor && field.sampleCount > 0) {
    return range(field.valueMin, field.valueMax);
  }
  const readings = rangeOf((twin.snapshot?.tags ?? []).map((tag) => tag.readings.get(view.sensor)));
  return readings && range(readings.low, readings.high);
}
