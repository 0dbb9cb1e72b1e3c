/** What the operator chose to look at. */
import type { Range } from '../domain/ramp';
import { KNOWN_SENSORS } from '../domain/sensors';
import type { HealthStatus } from '../domain/health';
import type { Camera } from '../geometry/coordinates';

export const LAYERS = [
  'map',
  'field',
  'smooth',
  'grid',
  'boxes',
  'blooms',
  'pins',
  'labels',
] as const;
export type Layer = (typeof LAYERS)[number];

/** What the page takes for a filter of the table, characters. */
export const LONGEST_FILTER = 200;

export interface Sort {
  /** A column's id; a sensor's is its name. */
  readonly column: string;
  readonly descending: boolean;
}

export interface ViewState {
  /** What is shown: null is now, a number a moment in the past, ROS seconds. */
  readonly moment: number | null;
  readonly sensor: string;
  /** Id of the tag whose card is open. */
  readonly selected: string | null;
  /** Id of the tag under the pointer, on the map or in the table. */
  readonly hovered: string | null;
  readonly layers: ReadonlySet<Layer>;
  /** Fixed colour scales by sensor; one without follows its data. */
  readonly ranges: ReadonlyMap<string, Range>;
  /** null: everything, and still so when the map grows. */
  readonly camera: Camera | null;
  readonly sort: Sort;
  readonly filter: string;
  readonly health: HealthStatus | null;
  /** Which half a narrow screen shows. */
  readonly pane: 'map' | 'tags';
}

export const DEFAULT_LAYERS: ReadonlySet<Layer> = new Set(
  LAYERS.filter((layer) => layer !== 'smooth'),
);

export const DEFAULT_VIEW: ViewState = {
  moment: null,
  sensor: KNOWN_SENSORS[0]?.name ?? 'temperature',
  selected: null,
  hovered: null,
  layers: DEFAULT_LAYERS,
  ranges: new Map(),
  camera: null,
  sort: { column: 'tag', descending: false },
  filter: '',
  health: null,
  pane: 'map',
};

/** The fixed colour scale of the sensor in view; null: that of the field itself. */
export function fixedRange({ ranges, sensor }: ViewState): Range | null {
  return ranges.get(sensor) ?? null;
}

export type ViewAction =
  /** Part of the view set from outside: a permalink. */
  | { readonly type: 'look'; readonly view: Partial<ViewState> }
  | { readonly type: 'sensor'; readonly sensor: string }
  | { readonly type: 'select'; readonly tagId: string | null }
  | { readonly type: 'hover'; readonly tagId: string | null }
  | { readonly type: 'layer'; readonly layer: Layer; readonly on: boolean }
  /** Of the sensor in view; null: as its data are. */
  | { readonly type: 'range'; readonly range: Range | null }
  | { readonly type: 'camera'; readonly camera: Camera | null }
  | { readonly type: 'sort'; readonly column: string }
  | { readonly type: 'filter'; readonly text: string }
  | { readonly type: 'health'; readonly status: HealthStatus | null }
  | { readonly type: 'pane'; readonly pane: ViewState['pane'] };

export function reduceView(view: ViewState, action: ViewAction): ViewState {
  switch (action.type) {
    case 'look':
      return { ...view, ...action.view };
    case 'sensor':
      return action.sensor === view.sensor ? view : { ...view, sensor: action.sensor };
    case 'select':
      return { ...view, selected: action.tagId };
    case 'hover':
      return action.tagId === view.hovered ? view : { ...view, hovered: action.tagId };
    case 'layer': {
      const layers = new Set(view.layers);
      if (action.on) layers.add(action.layer);
      else layers.delete(action.layer);
      return { ...view, layers };
    }
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
      return { ...view, health: action.status };
    case 'pane':
      return { ...view, pane: action.pane };
  }
}
