import { useSyncExternalStore } from 'react';

let now = performance.now();
let timer: ReturnType<typeof setInterval> | undefined;
const listeners = new Set<() => void>();

function subscribe(listener: () => void): () => void {
  listeners.add(listener);
  timer ??= setInterval(() => {
    now = performance.now();
    for (const each of [...listeners]) each();
  }, 1_000);
  return () => {
    listeners.delete(listener);
    if (listeners.size > 0) return;
    clearInterval(timer);
    timer = undefined;
  };
}

/** The monotonic clock in ms, ticking once a second for everyone at the same moment. */
export function useNow(): number {
  return useSyncExternalStore(subscribe, () => now);
}

/** Something that follows from the time; renders when it changes, not with each tick. */
export function useTicking<Part extends string | null>(part: (now: number) => Part): Part {
  return useSyncExternalStore(subscribe, () => part(now));
}

/** Time of day, ms since the epoch, of a moment on the monotonic clock. */
export function epochOf(moment: number): number {
  return Date.now() - (performance.now() - moment);
}
