/**
 * Test files share one process, and page tests one window: creating these per file takes longer than
 * most files' tests. So each file must restore what it changes: globals are stubbed with `vi`, which
 * restores them.
 */
import { vi } from 'vitest';

/** Tracks timers: those still running when a file ends would fire in the next one. */
function timersEnd(): () => void {
  const stops: (() => void)[] = [];
  for (const name of ['setTimeout', 'setInterval'] as const) {
    const start = globalThis[name] as typeof setTimeout;
    globalThis[name] = ((...given: Parameters<typeof setTimeout>) => {
      const timer = start(...given);
      stops.push(() => {
        // Ends timeouts and intervals alike.
        clearTimeout(timer);
      });
      return timer;
    }) as never;
  }
  return () => {
    for (const stop of stops) stop();
  };
}

/** Tracks listeners on objects that outlive a file, so that old modules get no later events. */
function listenersEnd(target: EventTarget): () => void {
  const stops: (() => void)[] = [];
  // eslint-disable-next-line @typescript-eslint/unbound-method
  const { addEventListener } = target;
  target.addEventListener = (...given: Parameters<EventTarget['addEventListener']>) => {
    addEventListener.apply(target, given);
    stops.push(() => target.removeEventListener(given[0], given[1], given[2]));
  };
  return () => {
    target.addEventListener = addEventListener;
    for (const stop of stops) stop();
  };
}

function emptied(element: Element): void {
  element.replaceChildren();
  for (const name of element.getAttributeNames()) element.removeAttribute(name);
}

function pageAsFound(): () => void {
  const ends = [listenersEnd(window), listenersEnd(document)];
  return () => {
    for (const end of ends) end();
    emptied(document.head);
    emptied(document.body);
    for (const name of document.documentElement.getAttributeNames()) {
      document.documentElement.removeAttribute(name);
    }
    localStorage.clear();
    sessionStorage.clear();
    // A new step clears the forward history.
    history.pushState(null, '', '/');
  };
}

/** Records the state; returns a function that restores it. */
export function asFound(): () => Promise<void> {
  const { setTimeout, setInterval } = globalThis;
  const page = typeof document === 'undefined' ? () => undefined : pageAsFound();
  const timers = timersEnd();
  return async () => {
    vi.useRealTimers();
    vi.restoreAllMocks();
    vi.unstubAllGlobals();
    vi.unstubAllEnvs();
    timers();
    // A module still loading at the reset would never arrive in the next file either.
    await vi.dynamicImportSettled();
    timers();
    // Modules have state, so each file gets its own.
    vi.resetModules();
    page();
    Object.assign(globalThis, { setTimeout, setInterval });
  };
}
