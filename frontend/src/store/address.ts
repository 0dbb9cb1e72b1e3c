/** The part of the view that a link carries, in the URL's fragment: it never reaches a server. */
import { COMPARED, type Compare } from '../domain/difference';
import { equal, isPossible } from '../domain/twin';
import { VERDICTS } from '../domain/health';
import { type Period, PERIOD_KINDS } from '../domain/time';
import type { Camera } from '../geometry/coordinates';
import { act, store } from './app';
import { PAGE } from './create';
import {
  type Charted,
  chartOf,
  DEFAULT_LAYERS,
  DEFAULT_VIEW,
  HEATS,
  isChosen,
  type Layer,
  LAYERS,
  LONGEST_FILTER,
  roundedMoment,
  type Sort,
  type ViewState,
} from './view';

/** A link says which half a narrow screen shows only for the alarms. */
export type Linked = Omit<ViewState, 'hovered' | 'chartedFrom' | 'pane'> &
  Partial<Pick<ViewState, 'pane'>>;

/** The fragment, without "#"; defaults are left out. */
export function toFragment(view: Linked): string {
  const parts = new URLSearchParams();
  if (view.moment !== null) parts.set('at', String(view.moment));
  if (view.period.kind === 'own') parts.set('period', `${view.period.from},${view.period.to}`);
  else if (isChosen(view.period)) parts.set('period', view.period.kind);
  if (view.compare) parts.set('compare', view.compare);
  for (const tagId of view.chart?.tagIds ?? []) parts.append(`chart.${view.chart?.by}`, tagId);
  if (view.sensor !== DEFAULT_VIEW.sensor) parts.set('sensor', view.sensor);
  if (view.selected !== null) parts.set('tag', view.selected);
  if (view.camera) {
    const { x, y, span } = view.camera;
    parts.set('view', [x, y, span].map((metres) => metres.toFixed(2)).join(','));
  }
  if (view.heat !== DEFAULT_VIEW.heat) parts.set('heat', view.heat);
  if (view.colouring !== DEFAULT_VIEW.colouring) parts.set('colour', view.colouring);
  if (view.kept?.sensor === view.sensor) parts.set('range', `${view.kept.low},${view.kept.high}`);
  const layers = layersText(view.layers);
  if (layers !== layersText(DEFAULT_LAYERS)) parts.set('layers', layers);
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

/** Reads a fragment; an invalid part counts as left out. */
export function fromFragment(fragment: string): Linked {
  const parts = new URLSearchParams(fragment.replace(/^#/, ''));
  const layers = parts.get('layers')?.split(',');
  const sensor = parts.get('sensor') || DEFAULT_VIEW.sensor;
  const [moment] = numbers(parts.get('at'), 1) ?? [];
  const [low = 0, high = 0] = numbers(parts.get('range'), 2) ?? [];
  return {
    moment: moment === undefined || moment < 0 ? null : roundedMoment(moment),
    period: periodOf(parts.get('period')),
    compare:
      (Object.keys(COMPARED) as Compare[]).find((each) => each === parts.get('compare')) ?? null,
    chart: chartedIn(parts),
    sensor,
    selected: parts.get('tag') || null,
    camera: cameraOf(numbers(parts.get('view'), 3)),
    heat: HEATS.find((kind) => kind === parts.get('heat')) ?? DEFAULT_VIEW.heat,
    colouring: parts.get('colour') === 'value' ? 'value' : 'ideal',
    kept: low < high ? { sensor, low, high } : null,
    layers: layers ? new Set(LAYERS.filter((layer) => layers.includes(layer))) : DEFAULT_LAYERS,
    sort: sortOf(parts.get('sort')),
    filter: (parts.get('filter') ?? '').slice(0, LONGEST_FILTER),
    health: VERDICTS.find((verdict) => verdict === parts.get('health')) ?? null,
    ...(parts.get('list') === 'alarms'
      ? { list: 'alarms', pane: 'tags' }
      : { list: DEFAULT_VIEW.list }),
  };
}

/** A name, or two moments in order, ROS seconds. */
function periodOf(text: string | null): Period {
  const kind = PERIOD_KINDS.find((each) => each === text);
  if (kind) return { kind };
  const [from, to] = numbers(text, 2) ?? [];
  if (from === undefined || to === undefined || from < 0 || from >= to) return DEFAULT_VIEW.period;
  return { kind: 'own', from, to };
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

function cameraOf(values: readonly number[] | null): Camera | null {
  const [x, y, span] = values ?? [];
  if (x === undefined || y === undefined || span === undefined || span <= 0) return null;
  return isPossible({ x, y }) ? { x, y, span } : null;
}

function numbers(text: string | null, count: number): readonly number[] | null {
  const values = (text ?? '').split(',').map((part) => (part.trim() === '' ? NaN : Number(part)));
  return values.length === count && values.every(Number.isFinite) ? values : null;
}

const layersText = (layers: ReadonlySet<Layer>): string =>
  LAYERS.filter((layer) => layers.has(layer)).join(',');

/** Browsers refuse more than about a hundred changes of the address in half a minute. */
const SETTLE_MS = 400;
/** A changed wall screen returns to its link after this long. */
const RETURN_MS = 120_000;

/** State of a history entry that the page made. */
interface Entry {
  /** Number of links followed: Back to an entry with another number follows its address. */
  readonly link: number;
  /** The tag whose card the entry is for; null: no card. */
  readonly tag: string | null;
  /** The past moment that the entry is for, ROS seconds; null: now. */
  readonly moment: number | null;
  /** What this step opened; the entry before is the page without it. Null: no such step. */
  readonly opened: 'tag' | 'moment' | null;
}

const placeOf = (view: Pick<ViewState, 'selected' | 'moment'>): Pick<Entry, 'tag' | 'moment'> => ({
  tag: view.selected,
  moment: view.moment,
});

/** Null: a link was just opened; only this module stores state there. */
const entryNow = (): Entry | null => history.state as Entry | null;

/**
 * Keeps the address a link to the screen, and follows opened links. Opening a card or a past moment
 * adds a step to the browser's history, so that Back closes it or returns to now. A wall screen
 * always shows what its address says, at present and without a chosen tag; the address is never
 * rewritten. `isRound`: the sensor alone changes by itself.
 */
export function startAddress(kiosk = false, isRound = false, signal = PAGE): void {
  if (kiosk) keepToLink(isRound, signal);
  else keepLink(signal);
}

function keepToLink(isRound: boolean, signal: AbortSignal): void {
  let timer: ReturnType<typeof setTimeout> | undefined;
  let { view } = store.get();
  const follow = (): void => {
    act({ ...fromFragment(window.location.hash), selected: null, moment: null });
    // The screen already shows what the link says.
    clearTimeout(timer);
  };
  const comeBack = (): void => {
    const { sensor } = view;
    follow();
    if (isRound) act({ sensor });
    clearTimeout(timer);
  };
  const onStore = (): void => {
    const before = view;
    ({ view } = store.get());
    if (view === before || (isRound && view.sensor !== before.sensor)) return;
    clearTimeout(timer);
    timer = setTimeout(comeBack, RETURN_MS);
  };
  follow();
  window.addEventListener('hashchange', follow, { signal });
  store.subscribe(onStore, signal);
  signal.addEventListener('abort', () => clearTimeout(timer));
}

function keepLink(signal: AbortSignal): void {
  let timer: ReturnType<typeof setTimeout> | undefined;
  let { view } = store.get();
  let entry: Entry = entryNow() ?? { link: 0, tag: null, moment: null, opened: null };
  /** A step back that the page requested; the browser takes it asynchronously. */
  let isGoingBack = false;

  const address = (): string => {
    const fragment = toFragment(store.get().view);
    const { pathname, search } = window.location;
    return `${pathname}${search}${fragment ? `#${fragment}` : ''}`;
  };
  /** Stores what the browser's entry is for, and updates its address. */
  const mark = (to: string): void => {
    const { pathname, search, hash } = window.location;
    const isSame = to === `${pathname}${search}${hash}` && equal(entryNow(), entry);
    if (!isSame) history.replaceState(entry, '', to);
  };
  const write = (): void => {
    clearTimeout(timer);
    // A link was just opened; it is followed on the browser's event.
    if (!entryNow()) return;
    entry = { ...entry, ...placeOf(store.get().view) };
    mark(address());
  };
  const follow = (): void => {
    const linked = fromFragment(window.location.hash);
    entry = { ...entry, ...placeOf(linked) };
    act(linked);
    clearTimeout(timer);
    mark(window.location.href.slice(window.location.origin.length));
  };
  const onHashChange = (): void => {
    // A step between the page's own entries: `onPopState` has handled it.
    if (entryNow()) return;
    entry = { link: entry.link + 1, tag: null, moment: null, opened: null };
    follow();
  };
  const onPopState = (): void => {
    const isOwnStep = isGoingBack;
    isGoingBack = false;
    const now = entryNow();
    if (!now) return;
    const isOtherLink = now.link !== entry.link;
    entry = now;
    if (isOtherLink) {
      follow();
      return;
    }
    const shown = store.get().view;
    if (isOwnStep) {
      // Another card may have been opened meanwhile.
      if (!step(shown)) write();
      return;
    }
    // The rest of the view stays, also another past moment: Back must not undo later changes.
    const isOtherTime = (now.moment === null) !== (shown.moment === null);
    if (isOtherTime || now.tag !== shown.selected) {
      const moment = isOtherTime ? now.moment : shown.moment;
      act({ selected: now.tag, moment });
    }
    write();
  };
  /** Enters or leaves the step of a card or past moment; true: nothing else to write. */
  const step = (shown: ViewState): boolean => {
    if (isGoingBack) return true;
    const place = placeOf(shown);
    const changed = (is: (a: unknown, b: unknown) => boolean): Entry['opened'] =>
      is(entry.tag, place.tag) ? 'tag' : is(entry.moment, place.moment) ? 'moment' : null;
    const opened = changed((before, now) => before === null && now !== null);
    if (opened) {
      entry = { ...entry, ...place, opened };
      history.pushState(entry, '', address());
      return true;
    }
    const closed = changed((before, now) => before !== null && now === null);
    if (closed) {
      isGoingBack = entry.opened === closed;
      if (isGoingBack) history.back();
      else entry = { ...entry, ...place };
      return isGoingBack;
    }
    return false;
  };
  const onStore = (): void => {
    if (store.get().view === view) return;
    ({ view } = store.get());
    clearTimeout(timer);
    if (!step(view)) timer = setTimeout(write, SETTLE_MS);
  };

  follow();
  window.addEventListener('hashchange', onHashChange, { signal });
  window.addEventListener('popstate', onPopState, { signal });
  store.subscribe(onStore, signal);
  signal.addEventListener('abort', () => clearTimeout(timer));
}
