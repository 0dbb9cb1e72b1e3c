import { useState } from 'react';

import { retainEqual } from '../domain/memo';
import { equal } from '../domain/twin';
import type { Size, View } from '../geometry/coordinates';
import { type Change, changed, createStore, PAGE, useSelected } from './create';
import { createFetcher, type FetcherOptions, type FetchTask } from './fetcher';
import { DEFAULT_SETTINGS, type Settings } from './settings';
import { NO_TWIN, type TwinState } from './twin';
import { DEFAULT_VIEW, type ViewState, viewAfter } from './view';

/** The part of the map on the screen; the operator's choice is the view's camera. */
export type Viewport = typeof NO_VIEWPORT;

export const NO_VIEWPORT = {
  view: { x: 0, y: 0, scale: 50 } as View,
  /** Of the canvas, CSS pixels; 0 until it is laid out. */
  size: { width: 0, height: 0 } as Size,
};

export type AppState = ReturnType<typeof store.get>;

export const store = createStore({
  twin: NO_TWIN,
  view: DEFAULT_VIEW,
  viewport: NO_VIEWPORT,
  settings: DEFAULT_SETTINGS,
});

const put = (part: Partial<AppState>): void => store.set(changed(store.get(), part));

export const act = (change: Change<ViewState>): void => {
  put({ view: viewAfter(store.get().view, change) });
};

export const receive = (change: Change<TwinState>): void => {
  put({ twin: changed(store.get().twin, change) });
};

/** Only for the map's camera, which follows wheel, finger and keys. */
export const moveViewport = (part: Partial<Viewport>): void => {
  put({ viewport: { ...store.get().viewport, ...part } });
};

export const prefer = (part: Partial<Settings>): void => {
  put({ settings: { ...store.get().settings, ...part } });
};

/** Calls back when one of these parts of the state changes. */
export function onChange(
  parts: (state: AppState) => readonly unknown[],
  listener: () => void,
  signal = PAGE,
): void {
  let seen = parts(store.get());
  store.subscribe(() => {
    const before = seen;
    seen = parts(store.get());
    if (seen.some((part, index) => part !== before[index])) listener();
  }, signal);
}

interface KeepOptions<T> extends FetcherOptions<T> {
  /** The parts of the state that the task depends on; none: all of it. */
  readonly parts?: (state: AppState) => readonly unknown[];
  /** The task depends on the time as well. */
  readonly everyMs?: number;
}

/** Fetches what the state needs; undefined: as before. */
export function keepFetched<T>(
  { everyMs, parts = (state) => [state], ...options }: KeepOptions<T>,
  taskFor: (state: AppState) => FetchTask<T> | null | undefined,
  signal = PAGE,
): void {
  const fetcher = createFetcher(options);
  const update = (): void => {
    const task = taskFor(store.get());
    if (task !== undefined) fetcher.want(task);
  };
  update();
  onChange(parts, update, signal);
  const timer = everyMs === undefined ? undefined : setInterval(update, everyMs);
  signal.addEventListener('abort', () => {
    clearInterval(timer);
    fetcher.want(null);
  });
}

export function useApp<Part>(select: (state: AppState) => Part): Part {
  return useSelected(store, select);
}

/** The same for a part that each state makes anew: it renders only when its content changes. */
export function useContent<Part extends object | null>(select: (state: AppState) => Part): Part {
  const [retain] = useState(() => retainEqual<object>(equal));
  return useApp((state) => {
    const part = select(state);
    return part && (retain(part) as Part);
  });
}
