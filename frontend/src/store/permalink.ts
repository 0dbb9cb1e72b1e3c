/** The part of the view that a link carries, in the URL's fragment: it never reaches a server. */
import type { Compare } from '../domain/difference';
import { isPossible } from '../domain/farOff';
import { VERDICTS } from '../domain/health';
import { PERIOD_KINDS, type Period } from '../domain/period';
import type { Range } from '../domain/ramp';
import type { Camera } from '../geometry/coordinates';
import {
  DEFAULT_LAYERS,
  DEFAULT_VIEW,
  chartOf,
  HEATS,
  isChosen,
  LAYERS,
  LONGEST_FILTER,
  roundedMoment,
  type Charted,
  type Layer,
  type Sort,
  type ViewState,
} from './view';

export type Linked = Pick<
  ViewState,
  | 'moment'
  | 'period'
  | 'compare'
  | 'chart'
  | 'sensor'
  | 'selected'
  | 'layers'
  | 'heat'
  | 'colouring'
  | 'ranges'
  | 'camera'
  | 'sort'
  | 'filter'
  | 'health'
  | 'list'
>;

/** The fragment, without "#"; what is as by default is left out. */
export function toFragment(view: Linked & Pick<ViewState, 'pane'>): string {
  const parts = new URLSearchParams();
  if (view.moment !== null) parts.set('at', String(view.moment));
  if (view.period.kind === 'own') parts.set('period', `${view.period.from},${view.period.to}`);
  else if (isChosen(view.period)) parts.set('period', view.period.kind);
  if (view.compare) parts.set('compare', compareText(view.compare));
  for (const tagId of view.chart?.tagIds ?? []) parts.append(`chart.${view.chart?.by}`, tagId);
  if (view.sensor !== DEFAULT_VIEW.sensor) parts.set('sensor', view.sensor);
  if (view.selected !== null) parts.set('tag', view.selected);
  if (view.camera) {
    const { x, y, span } = view.camera;
    parts.set('view', [x, y, span].map((metres) => metres.toFixed(2)).join(','));
  }
  if (view.heat !== DEFAULT_VIEW.heat) parts.set('heat', view.heat);
  if (view.colouring !== DEFAULT_VIEW.colouring) parts.set('colour', view.colouring);
  for (const [sensor, { low, high }] of view.ranges) {
    parts.set(rangeKey(sensor, view.sensor), `${short(low)},${short(high)}`);
  }
  if (!sameLayers(view.layers, DEFAULT_LAYERS)) {
    parts.set('layers', LAYERS.filter((layer) => view.layers.has(layer)).join(','));
  }
  const { column, descending } = view.sort;
  const usual = DEFAULT_VIEW.sort;
  if (column !== usual.column || descending !== usual.descending) {
    parts.set('sort', `${descending ? '-' : ''}${column}`);
  }
  if (view.filter !== '') parts.set('filter', view.filter);
  if (view.health !== null) parts.set('health', view.health);
  if (view.list !== DEFAULT_VIEW.list && view.pane === 'tags') parts.set('list', view.list);
  return parts.toString().replaceAll('%2C', ',');
}

/** Reads a fragment; a part that makes no sense counts as left out. */
export function fromFragment(fragment: string): Linked {
  const parts = new URLSearchParams(fragment.replace(/^#/, ''));
  const layers = parts.get('layers');
  const sensor = parts.get('sensor') || DEFAULT_VIEW.sensor;
  const [moment] = numbers(parts.get('at'), 1) ?? [];
  return {
    moment: moment === undefined || moment < 0 ? null : roundedMoment(moment),
    period: periodOf(parts.get('period')),
    compare: compareOf(parts.get('compare')),
    chart: chartedIn(parts),
    sensor,
    selected: parts.get('tag') || null,
    camera: cameraOf(numbers(parts.get('view'), 3)),
    heat: HEATS.find((kind) => kind === parts.get('heat')) ?? DEFAULT_VIEW.heat,
    colouring: parts.get('colour') === 'value' ? 'value' : 'ideal',
    ranges: rangesOf(parts, sensor),
    layers: layers === null ? DEFAULT_LAYERS : new Set(layers.split(',').filter(isLayer)),
    sort: sortOf(parts.get('sort')),
    filter: (parts.get('filter') ?? '').slice(0, LONGEST_FILTER),
    health: VERDICTS.find((verdict) => verdict === parts.get('health')) ?? null,
    list: parts.get('list') === 'alarms' ? 'alarms' : DEFAULT_VIEW.list,
  };
}

/** A name, or two moments in their order, ROS seconds. */
function periodOf(text: string | null): Period {
  const kind = PERIOD_KINDS.find((each) => each === text);
  if (kind) return { kind };
  const [from, to] = numbers(text, 2) ?? [];
  if (from === undefined || to === undefined || from < 0 || from >= to) return DEFAULT_VIEW.period;
  return { kind: 'own', from, to };
}

/** So many seconds before the moment that is shown, with a minus; or a moment, ROS seconds. */
const compareText = (compare: Compare): string =>
  String(compare.by === 'ago' ? -compare.seconds : compare.at);

function compareOf(text: string | null): Compare | null {
  const [value] = numbers(text, 1) ?? [];
  if (value === undefined || Object.is(value, -0)) return null;
  return value < 0 ? { by: 'ago', seconds: -value } : { by: 'moment', at: roundedMoment(value) };
}

const chartedIn = (parts: URLSearchParams): Charted | null => {
  const of = (by: Charted['by']): Charted => ({
    by,
    tagIds: parts.getAll(`chart.${by}`).filter((tagId) => tagId !== ''),
  });
  return chartOf(of('tag')) ?? chartOf(of('sensor'));
};

/** A column's name; a minus before it: descending. */
function sortOf(text: string | null): Sort {
  const descending = text?.startsWith('-') ?? false;
  const column = descending ? text?.slice(1) : text;
  return column ? { column, descending } : DEFAULT_VIEW.sort;
}

/** "range" is that of the sensor in view, "range.co2" that of another. */
const rangeKey = (sensor: string, inView: string): string =>
  sensor === inView ? 'range' : `range.${sensor}`;

function rangesOf(parts: URLSearchParams, inView: string): ReadonlyMap<string, Range> {
  const ranges = new Map<string, Range>();
  for (const [key, text] of parts) {
    const sensor = key === 'range' ? inView : key.startsWith('range.') ? key.slice(6) : '';
    const [low, high] = numbers(text, 2) ?? [];
    if (sensor === '' || low === undefined || high === undefined || low >= high) continue;
    ranges.set(sensor, { low, high });
  }
  return ranges;
}

function cameraOf(values: readonly number[] | null): Camera | null {
  const [x, y, span] = values ?? [];
  if (x === undefined || y === undefined || span === undefined || span <= 0) return null;
  return isPossible({ x, y }) ? { x, y, span } : null;
}

function numbers(text: string | null, count: number): readonly number[] | null {
  const values = (text ?? '').split(',').map((part) => (part.trim() === '' ? NaN : Number(part)));
  return values.length === count && values.every(Number.isFinite) ? values : null;
}

const short = (value: number): string => String(Number(value.toPrecision(6)));

const isLayer = (name: string): name is Layer => (LAYERS as readonly string[]).includes(name);

function sameLayers(a: ReadonlySet<Layer>, b: ReadonlySet<Layer>): boolean {
  return a.size === b.size && [...a].every((layer) => b.has(layer));
}
