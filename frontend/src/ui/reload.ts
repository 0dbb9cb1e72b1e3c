/** Automatic reload of a page that has failed, with back-off. */
import { timeOfDay } from '../clock';

const KEY = 'lupin-twin.reload';
const FIRST_MS = 5_000;
const LONGEST_MS = 300_000;
/** A page that worked for this long restarts the back-off when it fails, ms. */
const PROVEN_MS = 600_000;

interface StoredFailures {
  readonly failures: number;
  /** Time of the last failure, ms since the epoch: a reload resets every other clock. */
  readonly at: number;
}

type Session = Pick<Storage, 'getItem' | 'setItem'>;

/**
 * Records a failure and returns the pause before the reload, ms. It doubles with each failure in a
 * row, up to five minutes. Half of it is random, to keep a greenhouse's screens from reloading at
 * once. Without storage, every pause is the longest.
 *
 * @param random from 0 to 1
 */
export function pauseAfterFailure(session: Session, now: number, random: number): number {
  const before = read(session);
  // A clock set back says nothing about how long the page worked.
  const failures = before && now - before.at < PROVEN_MS ? before.failures + 1 : 1;
  const isStored = write(session, { failures, at: now });
  const doubled = FIRST_MS * 2 ** Math.min(failures - 1, 10);
  return (isStored ? Math.min(LONGEST_MS, doubled) : LONGEST_MS) * (0.5 + 0.5 * random);
}

function read(session: Session): StoredFailures | null {
  try {
    const stored: unknown = JSON.parse(session.getItem(KEY) ?? 'null');
    const { failures, at } = (stored ?? {}) as Partial<StoredFailures>;
    return Number.isSafeInteger(failures) && Number.isFinite(at)
      ? (stored as StoredFailures)
      : null;
  } catch {
    return null;
  }
}

function write(session: Session, stored: StoredFailures): boolean {
  try {
    session.setItem(KEY, JSON.stringify(stored));
    return true;
  } catch {
    return false;
  }
}

/** The tab's session storage, which survives a reload; if it is blocked, a stand-in that throws. */
function openSession(): Session {
  const refuse = (): never => {
    throw new Error('no session storage');
  };
  try {
    return window.sessionStorage;
  } catch {
    return { getItem: refuse, setItem: refuse };
  }
}

/**
 * Reloads the page after the due pause, but only once its server answers: the browser's own error
 * page would stay for ever.
 */
export function reloadByItself(
  session: Session = openSession(),
  reload: () => void = reloadNow,
): () => void {
  const gone = new AbortController();
  const { signal } = gone;
  const attempt = async (): Promise<void> => {
    const url = new URL(window.location.href);
    url.hash = '';
    const answer = await fetch(url, { cache: 'no-store', signal }).catch(() => null);
    if (signal.aborted) return;
    if (answer?.ok) reload();
    else timer = setTimeout(() => void attempt(), FIRST_MS);
  };
  const pause = pauseAfterFailure(session, timeOfDay(), Math.random());
  let timer = setTimeout(() => void attempt(), pause);
  return () => {
    gone.abort();
    clearTimeout(timer);
  };
}

export const reloadNow = (): void => {
  window.location.reload();
};
