/** What the operator chose to look at. */
import type { Verdict } from '../contract/types';
import type { Range } from '../domain/ramp';
import type { Compare } from '../domain/difference';
import type { Period } from '../domain/time';
import type { Camera } from '../geometry/coordinates';

export const LAYERS = [
  'map',
  'field',
  'unknown',
  'smooth',
  'grid',
  'boxes',
  'blooms',
  'pins',
  'labels',
  'advice',
  'robot',
] as const;
export type Layer = (typeof LAYERS)[number];

/** What the heat map is made of: the readings nearest to a cell, an estimate, or its error alone. */
export const HEATS = ['nearest', 'estimate', 'error'] as const;
type HeatKind = (typeof HEATS)[number];

/** What the page takes for a filter of the table, characters. */
export const LONGEST_FILTER = 200;

/** More lines in one chart nobody can tell apart. */
export const MOST_CHARTED = 8;

/** What is charted: all sensors of the first tag, or the sensor in view of them all. */
export interface Charted {
  readonly by: 'tag' | 'sensor';
  /** At least one, none twice. */
  readonly tagIds: readonly string[];
}

export interface Sort {
  /** A column's id; a sensor's is its name. */
  readonly column: string;
  readonly descending: boolean;
}

export interface ViewState {
  /** The moment to show: null is now, a number a moment in the past, ROS seconds. */
  readonly moment: number | null;
  /** The stretch of time that the bar below the map has, and charts too. */
  readonly period: Period;
  readonly sensor: string;
  /** Id of the tag whose card is open. */
  readonly selected: string | null;
  /** Id of the tag under the pointer, on the map or in the table. */
  readonly hovered: string | null;
  readonly layers: ReadonlySet<Layer>;
  readonly heat: HeatKind;
  /** What the heat map is the difference to; null: it is the field itself. */
  readonly compare: Compare | null;
  /** What the charts show; null: they are closed. */
  readonly chart: Charted | null;
  /** The half that the charts took the place of, and lead back to; null: none that is still wanted. */
  readonly chartedFrom: ViewState['pane'] | null;
  /** Whether colours tell how values lie against their ideal range, or how high they are. */
  readonly colouring: 'ideal' | 'value';
  /** Fixed colour scales by sensor; one without follows its data. */
  readonly ranges: ReadonlyMap<string, Range>;
  /** null: everything, and still so when the map grows. */
  readonly camera: Camera | null;
  readonly sort: Sort;
  readonly filter: string;
  readonly health: Verdict | null;
  /** Which half a narrow screen shows. */
  readonly pane: 'map' | 'tags';
  /** What stands beside the map: the table of tags, or the alarms of now. */
  readonly list: 'tags' | 'alarms';
}

export const DEFAULT_LAYERS: ReadonlySet<Layer> = new Set(
  LAYERS.filter((layer) => layer !== 'smooth' && layer !== 'advice'),
);

export const DEFAULT_VIEW: ViewState = {
  moment: null,
  period: { kind: 'day' },
  sensor: 'temperature',
  selected: null,
  hovered: null,
  layers: DEFAULT_LAYERS,
  heat: 'nearest',
  compare: null,
  chart: null,
  chartedFrom: null,
  colouring: 'ideal',
  ranges: new Map(),
  camera: null,
  // The worst first.
  sort: { column: 'health', descending: true },
  filter: '',
  health: null,
  pane: 'map',
  list: 'tags',
};

/** What is in place of the default period where memory is short; neither is anybody's choice. */
export const SHORT_PERIOD: Period = { kind: 'hour' };

/** Whether a link or a person has chosen it: told by which object it is, for a choice is a new one. */
export const isChosen = (period: Period): boolean =>
  period !== DEFAULT_VIEW.period && period !== SHORT_PERIOD;

/** The fixed colour scale of the sensor in view; null: that of the field itself. */
export function fixedRange({ ranges, sensor }: ViewState): Range | null {
  return ranges.get(sensor) ?? null;
}

/** Moments are told apart by the millisecond, and none is before the beginning of ROS time. */
export const roundedMoment = (moment: number): number =>
  Math.max(0, Math.round(moment * 1000) / 1000);

export type ViewAction =
  /** Part of the view set from outside: a permalink. */
  | { readonly type: 'look'; readonly view: Partial<ViewState> }
  /** To the millisecond; null: now. */
  | { readonly type: 'moment'; readonly moment: number | null }
  | { readonly type: 'period'; readonly period: Period }
  | { readonly type: 'compare'; readonly compare: Compare | null }
  | { readonly type: 'chart'; readonly chart: Charted | null }
  | { readonly type: 'sensor'; readonly sensor: string }
  | { readonly type: 'select'; readonly tagId: string | null }
  | { readonly type: 'hover'; readonly tagId: string | null }
  | { readonly type: 'layer'; readonly layer: Layer; readonly on: boolean }
  | { readonly type: 'heat'; readonly heat: HeatKind }
  | { readonly type: 'colouring'; readonly colouring: ViewState['colouring'] }
  /** Of the sensor in view; null: as its data are. */
  | { readonly type: 'range'; readonly range: Range | null }
  | { readonly type: 'camera'; readonly camera: Camera | null }
  | { readonly type: 'sort'; readonly column: string }
  | { readonly type: 'filter'; readonly text: string }
  | { readonly type: 'health'; readonly verdict: Verdict | null }
  | { readonly type: 'pane'; readonly pane: ViewState['pane'] }
  /** On a narrow screen it comes into view. */
  | { readonly type: 'list'; readonly list: ViewState['list'] };

export function reduceView(view: ViewState, action: ViewAction): ViewState {
  switch (action.type) {
    case 'look':
      return { ...view, ...action.view, ...(action.view.list === 'alarms' && { pane: 'tags' }) };
    case 'moment': {
      const moment = action.moment === null ? null : roundedMoment(action.moment);
      return moment === view.moment ? view : { ...view, moment };
    }
    case 'period':
      return { ...view, period: action.period };
    case 'sensor':
      return action.sensor === view.sensor ? view : { ...view, sensor: action.sensor };
    case 'compare':
      return { ...view, compare: action.compare };
    case 'chart':
      return charted(view, chartOf(action.chart));
    case 'select': {
      const { chart } = view;
      const follows = chart?.by === 'tag' && action.tagId !== null;
      return {
        ...view,
        selected: action.tagId,
        chart: follows ? { by: 'tag', tagIds: [action.tagId] } : chart,
      };
    }
    case 'hover':
      return action.tagId === view.hovered ? view : { ...view, hovered: action.tagId };
    case 'layer': {
      const layers = new Set(view.layers);
      if (action.on) layers.add(action.layer);
      else layers.delete(action.layer);
      return { ...view, layers };
    }
    case 'heat':
      return { ...view, heat: action.heat };
    case 'colouring':
      return { ...view, colouring: action.colouring };
    case 'range': {
      const ranges = new Map(view.ranges);
      if (action.range) ranges.set(view.sensor, action.range);
      else ranges.delete(view.sensor);
      return { ...view, ranges };
    }
    case 'camera':
      return { ...view, camera: action.camera };
    case 'sort': {
      const { column, descending } = view.sort;
      return {
        ...view,
        sort: { column: action.column, descending: action.column === column && !descending },
      };
    }
    case 'filter':
      return { ...view, filter: action.text };
    case 'health':
      // A filter of the table shows the table.
      return { ...view, health: action.verdict, list: 'tags' };
    case 'pane':
      return { ...view, pane: action.pane, chartedFrom: null };
    case 'list':
      return { ...view, list: action.list, pane: 'tags', chartedFrom: null };
  }
}

/** On a narrow screen the charts are where the map is. */
function charted(view: ViewState, chart: Charted | null): ViewState {
  const { pane, chartedFrom } = view;
  return chart
    ? { ...view, chart, pane: 'map', chartedFrom: view.chart ? chartedFrom : pane }
    : { ...view, chart, pane: chartedFrom ?? pane, chartedFrom: null };
}

/** As many as a chart may have, none of them twice; without any there is no chart. */
export function chartOf(chart: Charted | null): Charted | null {
  const tagIds = [...new Set(chart?.tagIds)].slice(0, MOST_CHARTED);
  return chart && tagIds.length > 0 ? { by: chart.by, tagIds } : null;
}
