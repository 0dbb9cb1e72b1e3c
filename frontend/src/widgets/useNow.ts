import { useSyncExternalStore } from 'react';

import { now } from '../clock';

let ticked = now();
let timer: ReturnType<typeof setInterval> | undefined;
const listeners = new Set<() => void>();

function subscribe(listener: () => void): () => void {
  listeners.add(listener);
  if (timer === undefined) {
    // Without listeners the clock stood still.
    ticked = now();
    timer = setInterval(() => {
      ticked = now();
      for (const each of [...listeners]) each();
    }, 1_000);
  }
  return () => {
    listeners.delete(listener);
    if (listeners.size > 0) return;
    clearInterval(timer);
    timer = undefined;
  };
}

/** The monotonic clock, ms, ticking once a second for all components together. */
export function useNow(): number {
  return useSyncExternalStore(subscribe, () => ticked);
}

/** A value derived from the time; re-renders when it changes, not on each tick. */
export function useTicking<Part extends string | null>(part: (now: number) => Part): Part {
  return useSyncExternalStore(subscribe, () => part(ticked));
}
