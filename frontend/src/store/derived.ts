/** What follows from the state; each remembers its last answer, so that it is worked out once. */
import { houseHealth, type HouseHealth } from '../domain/health';
import { rangeOf, type Range } from '../domain/ramp';
import { sensorsIn, type Sensor } from '../domain/sensors';
import { filterRows, rowsOf, sortRows, type Row } from '../domain/table';
import type { Tag } from '../domain/twin';
import type { AppState } from './app';
import { memoLast, memoOne } from './memo';
import { selectNewest, selectShown, selectTags } from './moment';
import { fixedRange, type Sort, type ViewState } from './view';

const healthOfTags = memoOne(houseHealth);

export const selectHealth = (state: AppState): ReturnType<typeof houseHealth> =>
  healthOfTags(selectTags(state));

/** As it is now, whatever moment is shown; null before anything has come. */
export function selectNewestHealth(state: AppState): HouseHealth | null {
  const { snapshot } = selectNewest(state);
  return snapshot && healthOfTags(snapshot.tags);
}

const sensorNames = memoLast(
  // The names as one string: a new snapshot with the same sensors keeps the same list.
  (joined: string): readonly Sensor[] => sensorsIn(joined === '' ? [] : joined.split('\u0000')),
);

const namesIn = memoLast((tags: readonly Tag[], chosen: string): string => {
  const names = new Set(tags.flatMap((tag) => [...tag.readings.keys()]));
  if (chosen) names.add(chosen);
  return [...names].sort().join('\u0000');
});

export const selectSensors = (state: AppState): readonly Sensor[] =>
  sensorNames(namesIn(selectTags(state), state.view.sensor));

const range = memoLast((low: number, high: number): Range => ({ low, high }));

const rangeOfReadings = memoLast((tags: readonly Tag[], sensor: string): Range | null =>
  rangeOf(tags.map((tag) => tag.readings.get(sensor))),
);

/** The range of the colours in use: the fixed one, else the field's, else the readings'. */
export function selectRange(state: AppState): Range | null {
  const { view } = state;
  const fixed = fixedRange(view);
  if (fixed) return fixed;
  const field = selectShown(state).field.value;
  if (field?.sensor === view.sensor && field.sampleCount > 0) {
    return range(field.valueMin, field.valueMax);
  }
  const readings = rangeOfReadings(selectTags(state), view.sensor);
  return readings && range(readings.low, readings.high);
}

const filtered = memoLast(
  (
    tags: readonly Tag[],
    health: ReturnType<typeof houseHealth>,
    filter: string,
    status: ViewState['health'],
  ): readonly Row[] => filterRows(rowsOf(tags, health), filter, status),
);

const sorted = memoLast((rows: readonly Row[], sort: Sort): readonly Row[] => sortRows(rows, sort));

/** The table's rows as the operator sees them: filtered and sorted. */
export function selectRows(state: AppState): readonly Row[] {
  const { filter, health, sort } = state.view;
  return sorted(filtered(selectTags(state), selectHealth(state), filter, health), sort);
}
