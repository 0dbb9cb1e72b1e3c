import { act, store } from './app';
import { fromFragment, toFragment } from './permalink';

/** Browsers refuse more than about a hundred changes of the address in half a minute. */
const SETTLE_MS = 400;
/** A wall screen that somebody has changed shows again what its link says after this long. */
const RETURN_MS = 120_000;

/** What an entry of the browser's history that the page made tells about itself. */
interface Entry {
  /** Counts the links that were followed: Back to an entry of another one follows its address. */
  readonly link: number;
  /** The tag whose card the entry is for; null: no card. */
  readonly tag: string | null;
  /** The entry before is the same page without a card. */
  readonly isOverPage: boolean;
}

function entryNow(): Entry | null {
  const state: unknown = history.state;
  return typeof state === 'object' && state !== null && 'link' in state && 'isOverPage' in state
    ? (state as Entry)
    : null;
}

/**
 * Keeps the address a link to what is on the screen, and follows a link that is opened. A card
 * that opens is a step of the browser's history, so that Back closes it. On a wall screen the
 * address is the law: it is never rewritten, and no tag is chosen.
 */
export function startAddress(kiosk = false): () => void {
  return kiosk ? keepToLink() : keepLink();
}

function keepToLink(): () => void {
  let timer: ReturnType<typeof setTimeout> | undefined;
  let { view } = store.get();
  const follow = (): void => {
    act({ type: 'look', view: { ...fromFragment(window.location.hash), selected: null } });
    // What the link says needs no return to it.
    clearTimeout(timer);
  };
  const onStore = (): void => {
    if (store.get().view === view) return;
    ({ view } = store.get());
    clearTimeout(timer);
    timer = setTimeout(follow, RETURN_MS);
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

function keepLink(): () => void {
  let timer: ReturnType<typeof setTimeout> | undefined;
  let { view } = store.get();
  let entry: Entry = entryNow() ?? { link: 0, tag: null, isOverPage: false };
  /** A step back that the page itself asked for, and that the browser takes in its own time. */
  let isGoingBack = false;

  const address = (): string => {
    const fragment = toFragment(store.get().view);
    const { pathname, search } = window.location;
    return `${pathname}${search}${fragment ? `#${fragment}` : ''}`;
  };
  /** Tells the browser's entry what it is for, and keeps its address or gives it another. */
  const mark = (to: string): void => {
    const { pathname, search, hash } = window.location;
    const now = entryNow();
    const isSame =
      to === `${pathname}${search}${hash}` &&
      now?.tag === entry.tag &&
      now.link === entry.link &&
      now.isOverPage === entry.isOverPage;
    if (!isSame) history.replaceState(entry, '', to);
  };
  const write = (): void => {
    clearTimeout(timer);
    entry = { ...entry, tag: store.get().view.selected };
    mark(address());
  };
  const follow = (): void => {
    const linked = fromFragment(window.location.hash);
    entry = { ...entry, tag: linked.selected };
    act({ type: 'look', view: linked });
    clearTimeout(timer);
    mark(window.location.href.slice(window.location.origin.length));
  };
  const onHashChange = (): void => {
    // A step between entries that the page made: `onPopState` has seen to it.
    if (entryNow()) return;
    entry = { link: entry.link + 1, tag: null, isOverPage: false };
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
    const { selected } = store.get().view;
    if (isOwnStep) {
      // Another card may have been opened meanwhile.
      if (!step(selected)) write();
      return;
    }
    // The rest of the view stays: what was done since is not to be undone.
    if (now.tag !== selected) act({ type: 'select', tagId: now.tag });
    write();
  };
  /** Enters or leaves the step of an open card; true: there is nothing else to write. */
  const step = (selected: string | null): boolean => {
    if (isGoingBack) return true;
    if (selected !== null && entry.tag === null) {
      entry = { ...entry, tag: selected, isOverPage: true };
      history.pushState(entry, '', address());
      return true;
    }
    if (selected === null && entry.tag !== null) {
      isGoingBack = entry.isOverPage;
      if (isGoingBack) history.back();
      else entry = { ...entry, tag: null };
      return isGoingBack;
    }
    return false;
  };
  const onStore = (): void => {
    if (store.get().view === view) return;
    ({ view } = store.get());
    clearTimeout(timer);
    if (!step(view.selected)) timer = setTimeout(write, SETTLE_MS);
  };

  follow();
  window.addEventListener('hashchange', onHashChange);
  window.addEventListener('popstate', onPopState);
  const stop = store.subscribe(onStore);
  return () => {
    window.removeEventListener('hashchange', onHashChange);
    window.removeEventListener('popstate', onPopState);
    clearTimeout(timer);
    stop();
  };
}
