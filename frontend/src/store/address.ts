import { act, store } from './app';
import { fromFragment, toFragment } from './permalink';

/** Browsers refuse more than about a hundred changes of the address in half a minute. */
const SETTLE_MS = 400;

/** Keeps the address a link to what is on the screen, and follows a link that is opened. */
export function startAddress(): () => void {
  let timer: ReturnType<typeof setTimeout> | undefined;
  let { view } = store.get();

  const follow = (): void => {
    act({ type: 'look', view: fromFragment(window.location.hash) });
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
    timer = setTimeout(write, SETTLE_MS);
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
