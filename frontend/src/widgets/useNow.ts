import { useSyncExternalStore } from 'react';

import { now } from '../clock';

let ticked = now();
let timer: ReturnType<typeof setInterval> | undefined;
const listeners = new Set<() => void>();

function subscribe(listener: () => void): () => void {
  listeners.add(listener);
  if (timer === undefined) {
    // Nobody has looked for a while.
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

/** The monotonic clock in ms, ticking once a second for everyone at the same moment. */
export function useNow(): number {
  return useSyncExternalStore(subscribe, () => ticked);
}

/** Something that follows from the time; renders when it changes, not with each tick. */
export function useTicking<Part extends string | null>(part: (now: number) => Part): Part {
  return useSyncExternalStore(subscribe, () => part(ticked));
}
