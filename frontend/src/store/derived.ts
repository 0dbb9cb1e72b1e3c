/** Values derived from the state; each caches its last result. */
import { houseHealth, type HouseHealth } from '../domain/health';
import type { Field } from '../contract/types';
import { symmetricRange } from '../domain/difference';
import { errorField, finer, onExplored } from '../domain/field';
import { type Range, rangeOf, rounded, withDistinctEnds, withIdeal } from '../domain/ramp';
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
  cataloguesOf,
  isMeasured,
  isOfDay,
  NO_CATALOGUES,
  rangesFor,
  type Catalogue,
  type Catalogues,
  type Sensor,
} from '../domain/sensors';
import {
  type AreaOnMap,
  areasOnMap,
  filterRows,
  inAreas,
  rowsOf,
  sortRows,
  type Row,
} from '../domain/table';
import { equal, type Tag } from '../domain/twin';
import type { AppState } from './app';
import { retainEqual, memoLast, memoOne } from '../domain/memo';
import {
  isReceivingNow,
  selectIsReceiving,
  selectLatest,
  selectShown,
  selectTags,
  shownTime,
} from './moment';
import { boundsOf } from '../geometry/coordinates';
import type { MapPicture } from '../geometry/image';
import type { Difference } from './twin';
import { isColumnShown } from './settings';
import type { Sort, ViewState } from './view';

const healthShown = memoLast(houseHealth);
const healthNow = memoLast(houseHealth);

export function selectHealth(state: AppState): HouseHealth {
  const { health } = selectShown(state);
  return healthShown(
    selectTags(state),
    health,
    selectIsReceiving(state),
    shownTime(state, 0) !== null,
  );
}

/** The current health, whatever moment is shown; null before the first state. */
export function selectLatestHealth(state: AppState): HouseHealth | null {
  const { snapshot, health } = selectLatest(state);
  return snapshot && healthNow(snapshot.tags, health, isReceivingNow(state));
}

/**
 * How many times as wide as deep the greenhouse is, by the floor plan: few tags say nothing about it. Null:
 * no plan. Of now, so that the layout stays while looking back.
 */
export function selectAspect(state: AppState): number | null {
  const bounds = boundsOf(selectLatest(state).map.value?.known ?? []);
  return bounds && (bounds.maxX - bounds.minX) / (bounds.maxY - bounds.minY);
}

const cataloguesIn = memoLast(cataloguesOf);

/** The sensors as shown: in the page's language and the operator's unit. */
export const selectCatalogues = ({ twin, settings }: AppState): Catalogues =>
  twin.sensors.value ? cataloguesIn(twin.sensors.value, settings.unit) : NO_CATALOGUES;

/** The sensors with the ranges of the shown moment: by day or by night. */
export function selectCatalogue(state: AppState): Catalogue {
  const { day, night } = selectCatalogues(state);
  return (selectShown(state).health?.house.day.is_day ?? true) ? day : night;
}

export const selectSensor = (state: AppState): Sensor =>
  selectCatalogue(state).named(state.view.sensor);

/** The heat map's source: the estimate and its error arrive together. */
export type Source = 'nearest' | 'estimate';

/** A computed sensor has no estimate: the twin estimates only what tags read. */
export const sourceOf = (state: AppState): Source =>
  state.view.heat !== 'nearest' && isMeasured(selectSensor(state)) ? 'estimate' : 'nearest';

/** A new snapshot with the same sensors keeps the same list. */
const retainedNames = retainEqual<readonly string[]>(equal);
const namesIn = memoLast((tags: readonly Tag[], chosen: string): readonly string[] => {
  const names = new Set(tags.flatMap((tag) => [...tag.readings.keys()]));
  if (chosen) names.add(chosen);
  return retainedNames([...names].sort());
});
const offered = memoLast((catalogue: Catalogue, names: readonly string[]) => catalogue.with(names));

export const selectSensors = (state: AppState): readonly Sensor[] =>
  offered(selectCatalogue(state), namesIn(selectTags(state), state.view.sensor));

const columnsIn = memoLast((sensors: readonly Sensor[], chosen: string) =>
  sensors.filter((sensor) => isMeasured(sensor) || (sensor.name === chosen && !isOfDay(sensor))),
);

/** All measured sensors; and the chosen one, if tags have derived values of it. */
export const selectColumns = (state: AppState): readonly Sensor[] =>
  columnsIn(selectSensors(state), state.view.sensor);

const notHidden = memoLast((columns: readonly Sensor[], hidden: readonly string[]) =>
  columns.filter(({ name }) => isColumnShown({ hidden }, name)),
);

export const selectShownColumns = (state: AppState): readonly Sensor[] =>
  notHidden(selectColumns(state), state.settings.hidden);

const retainedRange = retainEqual<Range>();

const rangeOfReadings = memoLast((tags: readonly Tag[], sensor: string): Range | null =>
  rangeOf(tags.map((tag) => tag.readings.get(sensor))),
);

/** The colour range by value: the kept one, else that of field or readings, with the ideal. */
export function selectRange(state: AppState): Range | null {
  const { view } = state;
  if (view.kept?.sensor === view.sensor) return view.kept;
  const { field, held } = selectShown(state);
  const isMapped = field.value?.sensor === view.sensor && field.value.sampleCount > 0;
  const readings = rangeOfReadings(selectTags(state), view.sensor);
  const needed =
    isMapped && held?.sensor === view.sensor ? held.range : readings && rounded(readings);
  if (!needed) return null;
  return retainedRange(withDistinctEnds(withIdeal(needed, selectSensor(state).ideal)));
}

const siteOf = ({ at, sureSpecies: species }: Tag): Site[] => (at ? [{ at, species }] : []);
/** New tags with unchanged places and plants keep the list. */
const retainedSites = retainEqual<readonly Site[]>(equal);
const sitesIn = memoOne((tags: readonly Tag[]) => retainedSites(tags.flatMap(siteOf)));

/** The same object for all fields on the same grid. */
const retainedGrid = retainEqual<CellGrid>();
const gridOf = memoOne(({ width, height, originX, originY, resolution }: Field) =>
  retainedGrid({ width, height, originX, originY, resolution }),
);

const zonesBy = memoLast(zonesOf);

export const selectZones = (state: AppState, field: Field): Zones =>
  zonesBy(gridOf(field), sitesIn(selectTags(state)), selectSensor(state));

export function selectHasIdeal(state: AppState): boolean {
  const sensor = selectSensor(state);
  return (
    sensor.ideal !== null ||
    (sensor.species.size > 0 &&
      selectTags(state).some(({ sureSpecies }) => rangesFor(sensor, sureSpecies).ideal !== null))
  );
}

/** By value if chosen, or if there is no ideal. */
export const selectColouring = (state: AppState): ViewState['colouring'] =>
  selectHasIdeal(state) ? state.view.colouring : 'value';

export interface Heat {
  readonly field: Field;
  readonly range: Range;
  /** The ranges that its colours show; null: they show values, or a difference. */
  readonly zones: Zones | null;
  /** The difference that it shows; null: it is the field itself. */
  readonly difference: Difference | null;
  readonly isError: boolean;
  /** 1 in each cell whose reading is too old, row 0 at the bottom; null: none is. */
  readonly old: Uint8Array | null;
}

const retainedHeat = retainEqual<Heat>();
const PLAIN = { zones: null, difference: null, isError: false, old: null } as const;

const retainedRead = retainEqual<readonly ReadSite[]>(equal);
const readBy = memoLast((...given: Parameters<typeof readSites>) =>
  retainedRead(readSites(...given)),
);
const oldBy = memoLast(oldCells);

/**
 * Where a field of the nearest readings shows one that is too old; an estimate has its growing
 * error instead.
 */
function selectOld(state: AppState, field: Field): Uint8Array | null {
  const { health } = selectShown(state);
  if (!health) return null;
  return oldBy(gridOf(field), readBy(selectTags(state), health.tags, selectSensor(state)));
}

const onMap = memoOne((field: Field) => {
  const fine = finer(field);
  return memoLast((map: MapPicture | null) => (map ? onExplored(fine, map) : fine));
});

/** The field of the shown moment, as far as the greenhouse is explored. */
function selectField(state: AppState): Field | null {
  const { field, map } = selectShown(state);
  const { value } = field;
  // The previous field is another one, and must not appear under this name.
  if (value?.sensor !== state.view.sensor) return null;
  const isEstimate = value.sureness !== undefined || value.noEstimate !== undefined;
  if (isEstimate !== (sourceOf(state) === 'estimate')) return null;
  return onMap(value)(map.value);
}

const errorOf = memoOne((field: Field): Field | null =>
  field.sureness ? errorField(field, field.sureness) : null,
);
const errorRange = memoOne(({ valueMax }: Field): Range => ({ low: 0, high: valueMax }));

const retainedDifference = retainEqual<Range>();

/** Null: there is none, the wanted one has not arrived, or its colours are not known yet. */
export function selectHeat(state: AppState): Heat | null {
  if (!state.twin.sensors.value) return null;
  const { compare } = state.view;
  if (compare) {
    const { value } = state.twin.difference;
    const given = value?.field;
    if (given?.sensor !== state.view.sensor || given.sampleCount === 0) return null;
    const field = onMap(given)(selectShown(state).map.value);
    const old = sourceOf(state) === 'nearest' ? selectOld(state, field) : null;
    const range = retainedDifference(symmetricRange(field, selectSensor(state)));
    return retainedHeat({ ...PLAIN, field, range, difference: value, old });
  }
  const field = selectField(state);
  const error = field && state.view.heat === 'error' ? errorOf(field) : null;
  if (error)
    return retainedHeat({ ...PLAIN, field: error, range: errorRange(error), isError: true });
  const range = selectRange(state);
  if (!field || !range || field.sampleCount === 0) return null;
  const isIdeal = selectColouring(state) === 'ideal';
  const old = field.sureness ? null : selectOld(state, field);
  return retainedHeat({
    ...PLAIN,
    field,
    range,
    old,
    zones: isIdeal ? selectZones(state, field) : null,
  });
}

/** The field whose known part is shown, possibly empty; null: none of this sensor has arrived. */
export function selectMapped(state: AppState): Field | null {
  const heated = selectHeat(state);
  if (heated) return heated.field;
  if (!state.view.compare) return selectField(state);
  const field = state.twin.difference.value?.field;
  return field?.sensor === state.view.sensor ? field : null;
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

/** What the table's rows are grouped by; null: nothing. */
export const selectAreaOf = (state: AppState): Catalogue['areaOf'] | null =>
  state.settings.byArea ? selectCatalogue(state).areaOf : null;

const areasOf = memoLast(areasOnMap);

const NO_AREAS: readonly AreaOnMap[] = [];

export function selectAreas(state: AppState): readonly AreaOnMap[] {
  const areaOf = selectAreaOf(state);
  return areaOf ? areasOf(selectTags(state), areaOf) : NO_AREAS;
}

const sorted = memoLast(
  (rows: readonly Row[], sort: Sort, areaOf: Catalogue['areaOf'] | null): readonly Row[] => {
    const found = sortRows(rows, sort);
    return areaOf ? inAreas(found, areaOf).flatMap(({ rows: own }) => own) : found;
  },
);

const idsOf = memoOne((rows: readonly Row[]) => new Set(rows.map(({ tag }) => tag.id)));

/** The tags that pass the table's filter; null: all. */
export function selectListed(state: AppState): ReadonlySet<string> | null {
  const { filter, health } = state.view;
  return filter.trim() === '' && health === null ? null : idsOf(selectRows(state));
}

export function selectRows(state: AppState): readonly Row[] {
  const { filter, health, sort } = state.view;
  const catalogue = selectCatalogue(state);
  const rows = filtered(selectTags(state), selectHealth(state), filter, health, catalogue);
  return sorted(rows, sort, selectAreaOf(state));
}
