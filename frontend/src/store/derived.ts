/** What follows from the state; each remembers its last answer, so that it is worked out once. */
import { houseHealth, type HouseHealth } from '../domain/health';
import type { Field, Judgement } from '../contract/types';
import { symmetricRange } from '../domain/difference';
import { errorField, onExplored } from '../domain/field';
import { type Range, rangeOf, rounded, toldApart, withIdeal } from '../domain/ramp';
import {
  type CellGrid,
  oldCells,
  type ReadSite,
  readSites,
  type Site,
  type Zones,
  zonesOf,
} from '../domain/ideal';
import {
  isMeasured,
  NO_CATALOGUES,
  rangesFor,
  type Catalogue,
  type Catalogues,
  type Sensor,
} from '../domain/sensors';
import { filterRows, inAreas, rowsOf, sortRows, type Row } from '../domain/table';
import type { Tag } from '../domain/twin';
import type { AppState } from './app';
import { memoLast, memoOne } from '../domain/memo';
import { isHeardNow, selectIsHeard, selectNewest, selectShown, selectTags } from './moment';
import type { MapPicture } from '../geometry/image';
import type { Difference } from './twin';
import { isColumnShown } from './settings';
import { fixedRange, type Sort, type ViewState } from './view';

const healthShown = memoLast(houseHealth);
const healthNow = memoLast(houseHealth);

/** As the bridge judged the moment that is shown. */
export const selectHealth = (state: AppState): HouseHealth =>
  healthShown(selectTags(state), selectShown(state).health, selectIsHeard(state));

/** As it is now, whatever moment is shown; null before anything has come. */
export function selectNewestHealth(state: AppState): HouseHealth | null {
  const { snapshot, health } = selectNewest(state);
  return snapshot && healthNow(snapshot.tags, health, isHeardNow(state));
}

/** The sensors by day and by night. */
export const selectCatalogues = (state: AppState): Catalogues =>
  state.twin.sensors.value ?? NO_CATALOGUES;

/** The sensors with the ranges that held at the moment that is shown: by day, or by night. */
export function selectCatalogue(state: AppState): Catalogue {
  const { day, night } = selectCatalogues(state);
  return (selectShown(state).health?.house.day.is_day ?? true) ? day : night;
}

/** The one in view. */
export const selectSensor = (state: AppState): Sensor =>
  selectCatalogue(state).named(state.view.sensor);

/** What the heat map is made of: the estimate and its error come in one. */
export type Source = 'nearest' | 'estimate';

/** What is computed has no estimate: the twin estimates what tags read. */
export const sourceOf = (state: AppState): Source =>
  state.view.heat !== 'nearest' && isMeasured(selectSensor(state)) ? 'estimate' : 'nearest';

const sensorNames = memoLast(
  // The names as one string: a new snapshot with the same sensors keeps the same list.
  (catalogue: Catalogue, joined: string): readonly Sensor[] =>
    catalogue.with(joined === '' ? [] : joined.split('\u0000')),
);

const namesIn = memoLast((tags: readonly Tag[], chosen: string): string => {
  const names = new Set(tags.flatMap((tag) => [...tag.readings.keys()]));
  if (chosen) names.add(chosen);
  return [...names].sort().join('\u0000');
});

export const selectSensors = (state: AppState): readonly Sensor[] =>
  sensorNames(selectCatalogue(state), namesIn(selectTags(state), state.view.sensor));

const measuredIn = memoOne((sensors: readonly Sensor[]) => sensors.filter(isMeasured));

/** Those that have a column in the table. */
export const selectColumns = (state: AppState): readonly Sensor[] =>
  measuredIn(selectSensors(state));

const notHidden = memoLast((columns: readonly Sensor[], hidden: readonly string[]) =>
  columns.filter(({ name }) => isColumnShown({ hidden }, name)),
);

/** Those of them that the operator has not hidden. */
export const selectShownColumns = (state: AppState): readonly Sensor[] =>
  notHidden(selectColumns(state), state.settings.hidden);

const range = memoLast((low: number, high: number): Range => ({ low, high }));

const rangeOfReadings = memoLast((tags: readonly Tag[], sensor: string): Range | null =>
  rangeOf(tags.map((tag) => tag.readings.get(sensor))),
);

/** The range of colours by value: the fixed one, else what field or readings need, and the ideal. */
export function selectRange(state: AppState): Range | null {
  const { view } = state;
  const fixed = fixedRange(view);
  if (fixed) return fixed;
  const { field, held } = selectShown(state);
  const isMapped = field.value?.sensor === view.sensor && field.value.sampleCount > 0;
  const readings = rangeOfReadings(selectTags(state), view.sensor);
  const needed =
    isMapped && held?.sensor === view.sensor ? held.range : readings && rounded(readings);
  if (!needed) return null;
  const { low, high } = toldApart(withIdeal(needed, selectSensor(state).ideal));
  return range(low, high);
}

const siteOf = ({ at, sureSpecies: species }: Tag): Site[] => (at ? [{ at, species }] : []);
const sitesIn = memoOne((tags: readonly Tag[]): readonly Site[] => tags.flatMap(siteOf));

/** New tags whose places and plants are those of before keep the list. */
const sitesKept = memoLast((key: string): readonly Site[] => JSON.parse(key) as Site[]);
const keyOf = memoOne((sites: readonly Site[]): string => JSON.stringify(sites));

/** The same for all fields that lie alike. */
const gridKept = memoLast((key: string) => JSON.parse(key) as CellGrid);
const gridOf = memoOne(({ width, height, originX, originY, resolution }: Field) =>
  gridKept(JSON.stringify({ width, height, originX, originY, resolution })),
);

const zonesBy = memoLast(zonesOf);

/** Which ranges hold where in a field, by the plants of the tags. */
export function selectZones(state: AppState, field: Field): Zones {
  const sites = sitesKept(keyOf(sitesIn(selectTags(state))));
  return zonesBy(gridOf(field), sites, selectSensor(state));
}

/** Whether some plant of the house has an ideal of the sensor. */
export function selectHasIdeal(state: AppState): boolean {
  const sensor = selectSensor(state);
  return (
    sensor.ideal !== null ||
    (sensor.species.size > 0 &&
      selectTags(state).some(({ sureSpecies }) => rangesFor(sensor, sureSpecies).ideal !== null))
  );
}

/** By value where that is chosen, and where there is no ideal. */
export const selectColouring = (state: AppState): ViewState['colouring'] =>
  selectHasIdeal(state) ? state.view.colouring : 'value';

/** What the heat map shows, and in which range of colours. */
export interface Heat {
  readonly field: Field;
  readonly range: Range;
  /** The ranges that its colours are about; null: they tell its values, or a difference. */
  readonly zones: Zones | null;
  /** What it is the difference of; null: it is the field itself. */
  readonly difference: Difference | null;
  /** It is the estimate's error alone. */
  readonly isError: boolean;
  /** 1 in each cell whose reading is too old to say, row 0 at the bottom; null: none is. */
  readonly old: Uint8Array | null;
}

const heat = memoLast(
  (
    field: Field,
    within: Range,
    zones: Zones | null,
    difference: Difference | null,
    isError: boolean,
    old: Uint8Array | null,
  ): Heat => ({ field, range: within, zones, difference, isError, old }),
);

const readSitesBy = memoOne(({ tags: said }: Judgement) =>
  memoLast((tags: readonly Tag[], sensor: Sensor) => readSites(tags, said, sensor)),
);
const keyOfRead = memoOne((sites: readonly ReadSite[]): string =>
  sites.some(({ isOld }) => isOld) ? JSON.stringify(sites) : '[]',
);
const oldBy = memoLast((grid: CellGrid, sites: string) =>
  oldCells(grid, JSON.parse(sites) as readonly ReadSite[]),
);

/**
 * Where a field of the nearest readings stands for one that is too old to say; what an estimate is
 * worth by then is in its own error.
 */
function selectOld(state: AppState, field: Field): Uint8Array | null {
  const { health } = selectShown(state);
  if (!health || field.sensor !== state.view.sensor) return null;
  const sites = readSitesBy(health)(selectTags(state), selectSensor(state));
  return oldBy(gridOf(field), keyOfRead(sites));
}

const onMap = memoOne((field: Field) =>
  memoLast((map: MapPicture | null) => (map ? onExplored(field, map) : field)),
);

/** The field of the moment that is shown, as far as the house is explored. */
function selectField(state: AppState): Field | null {
  const { field, map } = selectShown(state);
  const { value } = field;
  // The one of before is none of what is wanted: under its name it would be taken for it.
  const isEstimate = Boolean(value?.sureness ?? value?.noEstimate);
  if (!value || isEstimate !== (sourceOf(state) === 'estimate')) return null;
  return onMap(value)(map.value);
}

const errorOf = memoOne((field: Field): Field | null =>
  field.sureness ? errorField(field, field.sureness) : null,
);
const errorRange = memoOne(({ valueMax }: Field): Range => ({ low: 0, high: valueMax }));

const differenceRange = memoOne((field: Field) =>
  memoLast((sensor: Sensor) => symmetricRange(field, sensor)),
);

/** Null: there is none, or the one that is wanted is not here, or nobody knows its colours yet. */
export function selectHeat(state: AppState): Heat | null {
  if (!state.twin.sensors.value) return null;
  const { compare } = state.view;
  if (compare) {
    const { value } = state.twin.difference;
    const field = value?.field;
    if (!field || field.sampleCount === 0) return null;
    const old = sourceOf(state) === 'nearest' ? selectOld(state, field) : null;
    return heat(field, differenceRange(field)(selectSensor(state)), null, value, false, old);
  }
  const field = selectField(state);
  const error = field && state.view.heat === 'error' ? errorOf(field) : null;
  if (error) return heat(error, errorRange(error), null, null, true, null);
  const within = selectRange(state);
  if (!field || !within || field.sampleCount === 0) return null;
  const isIdeal = selectColouring(state) === 'ideal' && field.sensor === state.view.sensor;
  const old = field.sureness ? null : selectOld(state, field);
  return heat(field, within, isIdeal ? selectZones(state, field) : null, null, false, old);
}

/** The field whose known part is shown, empty ones too; null: none of the sensor is here. */
export function selectMapped(state: AppState): Field | null {
  const heated = selectHeat(state);
  if (heated || state.view.compare) return heated?.field ?? null;
  const value = selectField(state);
  return value?.sensor === state.view.sensor ? value : null;
}

const filtered = memoLast(
  (
    tags: readonly Tag[],
    health: HouseHealth,
    filter: string,
    verdict: ViewState['health'],
    catalogue: Catalogue,
  ): readonly Row[] => filterRows(rowsOf(tags, health), filter, verdict, catalogue),
);

/** By what the table's rows are together; null: by nothing. */
export const selectAreaOf = (state: AppState): Catalogue['areaOf'] | null =>
  state.settings.byArea ? selectCatalogue(state).areaOf : null;

const sorted = memoLast(
  (rows: readonly Row[], sort: Sort, areaOf: Catalogue['areaOf'] | null): readonly Row[] => {
    const found = sortRows(rows, sort);
    return areaOf ? inAreas(found, areaOf).flatMap(({ rows: own }) => own) : found;
  },
);

const idsOf = memoOne((rows: readonly Row[]) => new Set(rows.map(({ tag }) => tag.id)));

/** The tags that the table's filter leaves; null: all of them. */
export function selectListed(state: AppState): ReadonlySet<string> | null {
  const { filter, health } = state.view;
  return filter.trim() === '' && health === null ? null : idsOf(selectRows(state));
}

/** The table's rows as the operator sees them: filtered, sorted, and together by area. */
export function selectRows(state: AppState): readonly Row[] {
  const { filter, health, sort } = state.view;
  const catalogue = selectCatalogue(state);
  const rows = filtered(selectTags(state), selectHealth(state), filter, health, catalogue);
  return sorted(rows, sort, selectAreaOf(state));
}
