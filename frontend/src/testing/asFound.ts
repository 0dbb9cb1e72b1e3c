/**
 * Test files share one process, and those of the page one window: to make these for each takes
 * longer than most files' tests. So each file leaves everything as it found it: what it sets on
 * global things, it sets with `vi`, which puts that back.
 */
import { vi } from 'vitest';

/** Timers that still run when the file ends would call into the next one's window. */
function timersEnd(): () => void {
  const stops: (() => void)[] = [];
  for (const name of ['setTimeout', 'setInterval'] as const) {
    const start = globalThis[name] as typeof setTimeout;
    globalThis[name] = ((...given: Parameters<typeof setTimeout>) => {
      const timer = start(...given);
      stops.push(() => {
        // Which ends either.
        clearTimeout(timer);
      });
      return timer;
    }) as never;
  }
  return () => {
    for (const stop of stops) stop();
  };
}

/** Listeners on what outlives a file: no module of the last one hears the next one's events. */
function listenersEnd(target: EventTarget): () => void {
  const stops: (() => void)[] = [];
  // eslint-disable-next-line @typescript-eslint/unbound-method
  const { addEventListener } = target;
  target.addEventListener = (...given: Parameters<EventTarget['addEventListener']>) => {
    addEventListener.apply(target, given);
    stops.push(() => {
      target.removeEventListener(given[0], given[1], given[2]);
    });
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
    // A new step, so that there is nothing to go forward to.
    history.pushState(null, '', '/');
  };
}

/** Looks round; what it returns puts everything back as it was. */
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
    // One that is half loaded when the modules are forgotten never comes in the next file either.
    await vi.dynamicImportSettled();
    timers();
    // The page's modules keep state; each file has its own.
    vi.resetModules();
    page();
    Object.assign(globalThis, { setTimeout, setInterval });
  };
}
