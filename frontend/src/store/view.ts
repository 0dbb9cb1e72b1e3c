import type { Verdict } from '../contract/types';
import type { Compare } from '../domain/difference';
import type { Range } from '../domain/ramp';
import type { Period } from '../domain/time';
import type { Camera } from '../geometry/coordinates';
import { type Change, changed } from './create';

export const LAYERS = [
  'map',
  'field',
  'unknown',
  'grid',
  'boxes',
  'blooms',
  'pins',
  'labels',
  'advice',
  'robot',
] as const;
export type Layer = (typeof LAYERS)[number];

/** The heat map's source: the nearest readings, an estimate, or its error alone. */
export const HEATS = ['nearest', 'estimate', 'error'] as const;
type HeatKind = (typeof HEATS)[number];

/** Longest table filter, characters. */
export const LONGEST_FILTER = 200;

/** More lines in one chart are indistinguishable. */
export const MOST_CHARTED = 8;

/** What is charted: all sensors of the first tag, or the sensor in view of every tag. */
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
  /** The period of the time bar and the charts. */
  readonly period: Period;
  readonly sensor: string;
  /** Id of the tag whose card is open. */
  readonly selected: string | null;
  /** Id of the tag under the pointer, on the map or in the table. */
  readonly hovered: string | null;
  readonly layers: ReadonlySet<Layer>;
  readonly heat: HeatKind;
  /** What the heat map is compared with; null: nothing. */
  readonly compare: Compare | null;
  readonly chart: Charted | null;
  /** The half that the charts replaced, and closing them returns to; null: none. */
  readonly chartedFrom: ViewState['pane'] | null;
  /** Whether colours show values against their ideal range, or how high they are. */
  readonly colouring: 'ideal' | 'value';
  /** A sensor's colour range that stays, so that moments can be compared; null: it follows the values. */
  readonly kept: (Range & { readonly sensor: string }) | null;
  /** null: everything, also when the map grows. */
  readonly camera: Camera | null;
  readonly sort: Sort;
  readonly filter: string;
  readonly health: Verdict | null;
  /** Which half a narrow screen shows. */
  readonly pane: 'map' | 'tags';
  /** The list beside the map: tags, or current alarms. */
  readonly list: 'tags' | 'alarms';
}

export const DEFAULT_LAYERS: ReadonlySet<Layer> = new Set(
  LAYERS.filter((layer) => layer !== 'advice'),
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
  kept: null,
  camera: null,
  // The worst first.
  sort: { column: 'health', descending: true },
  filter: '',
  health: null,
  pane: 'map',
  list: 'tags',
};

/** Replaces the default period if the history is short; neither is a user's choice. */
export const SHORT_PERIOD: Period = { kind: 'hour' };

/** Whether a link or a user has chosen it: a choice is always a new object. */
export const isChosen = (period: Period): boolean =>
  period !== DEFAULT_VIEW.period && period !== SHORT_PERIOD;

/** Rounds to milliseconds; no moment is before ROS time 0. */
export const roundedMoment = (moment: number): number =>
  Math.max(0, Math.round(moment * 1000) / 1000);

export function viewAfter(view: ViewState, change: Change<ViewState>): ViewState {
  const next = changed(view, change);
  return next.moment === null
    ? next
    : changed(view, { ...next, moment: roundedMoment(next.moment) });
}

type With = (view: ViewState) => Partial<ViewState>;

/** Charts of a tag follow the chosen tag. */
export const withTag =
  (tagId: string | null): With =>
  ({ chart }) => ({
    selected: tagId,
    chart: chart?.by === 'tag' && tagId !== null ? { by: 'tag', tagIds: [tagId] } : chart,
  });

export const withLayer =
  (layer: Layer, on: boolean): With =>
  ({ layers }) => ({
    layers: new Set(LAYERS.filter((each) => (each === layer ? on : layers.has(each)))),
  });

export const withSort =
  (column: string): With =>
  ({ sort }) => ({ sort: { column, descending: column === sort.column && !sort.descending } });

/** On a narrow screen, the list replaces the map. */
export const withList = (list: ViewState['list']): Partial<ViewState> => ({
  ...{ list, pane: 'tags', chartedFrom: null },
});

/** On a narrow screen, the charts replace the map. */
export const withChart =
  (wanted: Charted | null): With =>
  ({ pane, chartedFrom, chart: before }) => {
    const chart = chartOf(wanted);
    return chart
      ? { chart, pane: 'map', chartedFrom: before ? chartedFrom : pane }
      : { chart, pane: chartedFrom ?? pane, chartedFrom: null };
  };

/** At most as many tags as a chart can show, none twice; without tags there is no chart. */
export function chartOf(chart: Charted | null): Charted | null {
  const tagIds = [...new Set(chart?.tagIds)].slice(0, MOST_CHARTED);
  return chart && tagIds.length > 0 ? { by: chart.by, tagIds } : null;
}
