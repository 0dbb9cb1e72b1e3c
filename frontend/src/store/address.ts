import { act, store } from './app';
import { fromFragment, toFragment } from './permalink';
import type { ViewState } from './view';

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
  /** The moment in the past that it is for, ROS seconds; null: now. */
  readonly moment: number | null;
  /** What this step opened: the entry before is the same page without. Null: it is no such step. */
  readonly opened: 'tag' | 'moment' | null;
}

const placeOf = (view: Pick<ViewState, 'selected' | 'moment'>): Pick<Entry, 'tag' | 'moment'> => ({
  tag: view.selected,
  moment: view.moment,
});

function entryNow(): Entry | null {
  const state: unknown = history.state;
  return typeof state === 'object' && state !== null && 'link' in state && 'opened' in state
    ? (state as Entry)
    : null;
}

/**
 * Keeps the address a link to what is on the screen, and follows a link that is opened. A card
 * that opens is a step of the browser's history, so that Back closes it, and so is a look back,
 * from which Back leads to now. On a wall screen the address is the law: it is never rewritten, no
 * tag is chosen, and it always shows now. `isRound`: but for the sensor, which changes by itself.
 */
export function startAddress(kiosk = false, isRound = false): () => void {
  return kiosk ? keepToLink(isRound) : keepLink();
}

function keepToLink(isRound: boolean): () => void {
  let timer: ReturnType<typeof setTimeout> | undefined;
  let { view } = store.get();
  const follow = (): void => {
    act({
      type: 'look',
      view: { ...fromFragment(window.location.hash), selected: null, moment: null },
    });
    // What the link says needs no return to it.
    clearTimeout(timer);
  };
  const comeBack = (): void => {
    const { sensor } = view;
    follow();
    if (isRound) act({ type: 'sensor', sensor });
    clearTimeout(timer);
  };
  const onStore = (): void => {
    const before = view;
    ({ view } = store.get());
    if (view === before || (isRound && view.sensor !== before.sensor)) return;
    clearTimeout(timer);
    timer = setTimeout(comeBack, RETURN_MS);
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
  let entry: Entry = entryNow() ?? { link: 0, tag: null, moment: null, opened: null };
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
      now.moment === entry.moment &&
      now.link === entry.link &&
      now.opened === entry.opened;
    if (!isSame) history.replaceState(entry, '', to);
  };
  const write = (): void => {
    clearTimeout(timer);
    // A link has been opened just now, and is followed as soon as the browser tells of it.
    if (!entryNow()) return;
    entry = { ...entry, ...placeOf(store.get().view) };
    mark(address());
  };
  const follow = (): void => {
    const linked = fromFragment(window.location.hash);
    entry = { ...entry, ...placeOf(linked) };
    act({ type: 'look', view: linked });
    clearTimeout(timer);
    mark(window.location.href.slice(window.location.origin.length));
  };
  const onHashChange = (): void => {
    // A step between entries that the page made: `onPopState` has seen to it.
    if (entryNow()) return;
    entry = { link: entry.link + 1, tag: null, moment: null, opened: null };
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
    const shown = store.get().view;
    if (isOwnStep) {
      // Another card may have been opened meanwhile.
      if (!step(shown)) write();
      return;
    }
    // The rest of the view stays, another moment in the past too: what was done since is not to
    // be undone.
    const isOtherTime = (now.moment === null) !== (shown.moment === null);
    if (isOtherTime || now.tag !== shown.selected) {
      const moment = isOtherTime ? now.moment : shown.moment;
      act({ type: 'look', view: { selected: now.tag, moment } });
    }
    write();
  };
  /** Enters or leaves the step of a card or of a look back; true: there is nothing else to write. */
  const step = (shown: ViewState): boolean => {
    if (isGoingBack) return true;
    const place = placeOf(shown);
    const changed = (is: (a: unknown, b: unknown) => boolean): Entry['opened'] =>
      is(entry.tag, place.tag) ? 'tag' : is(entry.moment, place.moment) ? 'moment' : null;
    const opened = changed((before, now) => before === null && now !== null);
    if (opened) {
      entry = { ...entry, ...place, opened };
      history.pushState(entry, '', address());
      return true;
    }
    const closed = changed((before, now) => before !== null && now === null);
    if (closed) {
      isGoingBack = entry.opened === closed;
      if (isGoingBack) history.back();
      else entry = { ...entry, ...place };
      return isGoingBack;
    }
    return false;
  };
  const onStore = (): void => {
    if (store.get().view === view) return;
    ({ view } = store.get());
    clearTimeout(timer);
    if (!step(view)) timer = setTimeout(write, SETTLE_MS);
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
