import { act, store } from './app';
import { fromFragment, toFragment } from './permalink';

/** Browsers refuse more than about a hundred changes of the address in half a minute. */
const SETTLE_MS = 400;

/** A wall screen that somebody has changed shows again what its link says after this long. */
const RETURN_MS = 120_000;

/**
 * Keeps the address a link to what is on the screen, and follows a link that is opened. On a
 * wall screen the address is the law: it is never rewritten, and no tag is chosen.
 */
export function startAddress(kiosk = false): () => void {
  let timer: ReturnType<typeof setTimeout> | undefined;
  let { view } = store.get();

  const follow = (): void => {
    const linked = fromFragment(window.location.hash);
    act({ type: 'look', view: kiosk ? { ...linked, selected: null } : linked });
    // What the link says needs no return to it.
    if (kiosk) clearTimeout(timer);
  };
  const write = (): void => {
    const fragment = toFragment(store.get().view);
    if (fragment === window.location.hash.slice(1)) return;
    const { pathname, search } = window.location;
    history.replaceState(null, '', `${pathname}${search}${fragment ? `#${fragment}` : ''}`);
  };
  const onStore = (): void => {
    if (store.get().view === view) return;
    ({ view } = store.get());
    clearTimeout(timer);
    timer = kiosk ? setTimeout(follow, RETURN_MS) : setTimeout(write, SETTLE_MS);
  };

  follow();
  window.addEventListener('hashchange', follow);
  const stop = store.subscribe(onStore);
  return () => {
    window.removeEventListener('hashchange', follow);
    clearTimeout(timer);
    stop();
  };
}
