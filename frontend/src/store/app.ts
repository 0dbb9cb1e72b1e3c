import type { Size, View } from '../geometry/coordinates';
import { createStore, useSelected } from './create';
import { DEFAULT_SETTINGS, type Settings } from './settings';
import { NO_TWIN, reduceTwin, type TwinAction, type TwinState } from './twin';
import { DEFAULT_VIEW, reduceView, type ViewAction, type ViewState } from './view';

/** What of the map is on the screen just now; what the operator chose is the view's camera. */
export interface Viewport {
  /** Where the map is on its canvas. */
  readonly view: View;
  /** Of the canvas, CSS pixels; 0 until it is laid out. */
  readonly size: Size;
}

export const NO_VIEWPORT: Viewport = {
  view: { x: 0, y: 0, scale: 50 },
  size: { width: 0, height: 0 },
};

export interface AppState {
  readonly twin: TwinState;
  readonly view: ViewState;
  readonly viewport: Viewport;
  readonly settings: Settings;
}

type Change = (state: AppState) => AppState;

export const store = createStore<AppState, Change>(
  {
    twin: NO_TWIN,
    view: DEFAULT_VIEW,
    viewport: NO_VIEWPORT,
    settings: DEFAULT_SETTINGS,
  },
  (state, change) => change(state),
);

export const act = (action: ViewAction): void => {
  store.dispatch((state) => {
    const view = reduceView(state.view, action);
    return view === state.view ? state : { ...state, view };
  });
};

export const receive = (action: TwinAction): void => {
  store.dispatch((state) => {
    const twin = reduceTwin(state.twin, action);
    return twin === state.twin ? state : { ...state, twin };
  });
};

/** For the map's camera alone, which keeps it in step with wheel, finger and keys. */
export const moveViewport = (part: Partial<Viewport>): void => {
  store.dispatch((state) => ({ ...state, viewport: { ...state.viewport, ...part } }));
};

export const prefer = (part: Partial<Settings>): void => {
  store.dispatch((state) => ({ ...state, settings: { ...state.settings, ...part } }));
};

/** Calls back when one of these parts of the state is another; returns the way to stop. */
export function onChange(
  parts: (state: AppState) => readonly unknown[],
  listener: () => void,
): () => void {
  let seen = parts(store.get());
  return store.subscribe(() => {
    const before = seen;
    seen = parts(store.get());
    if (seen.some((part, index) => part !== before[index])) listener();
  });
}

export function useApp<Part>(select: (state: AppState) => Part): Part {
  return useSelected(store, select);
}
