/**
 * Fetches whatever is wanted just now, while somebody drags: the newest wish wins, what comes
 * late is passed over, and nothing queues. Wishes that cannot be had in time are dropped.
 */
import { now } from '../clock';
import { Refusal } from '../contract/api';

/** So many fetches at once: the next is on its way while one is being answered. */
const MOST_RUNNING = 2;
/** Shortest time between two starts: a dozen a second, which a server of this kind allows. */
const PACE_MS = 80;
/** A wish that has stood for so long is what the operator has come to; older fetches then end. */
const SETTLED_MS = 250;
/** A fetch that takes longer has failed. */
const TIMEOUT_MS = 20_000;
/** What has come is used again for so long: the past may still change when something is heard late. */
const KEEP_MS = 30_000;
const MOST_KEPT = 60;
/** After a failure nothing is asked for so long at least. */
const CALM_MS = 500;
const RETRY_FIRST_MS = 2_000;
const RETRY_LONGEST_MS = 30_000;

/** Something to fetch. */
export interface Wish<T> {
  /** What it depends on; of two wishes with one key the first will do. */
  readonly key: string;
  readonly run: (signal: AbortSignal) => Promise<T>;
}

export interface SeekerOptions<T> {
  /** Something that was wanted, and nothing older than what was told before. */
  readonly onValue: (value: T) => void;
  /** What is wanted cannot be had; unless `isLasting`, it is tried again. */
  readonly onError: (error: unknown, isLasting: boolean) => void;
}

export interface Seeker<T> {
  /** Null: nothing any more; all that is under way ends. */
  readonly want: (wish: Wish<T> | null) => void;
}

/** A refusal that asking again does not change: what is asked, or that nothing is kept. */
const isLasting = (error: unknown): boolean =>
  error instanceof Refusal && (error.status === 400 || error.status === 404);

export function createSeeker<T>(options: SeekerOptions<T>): Seeker<T> {
  interface Running {
    readonly key: string;
    readonly order: number;
    readonly abort: AbortController;
  }
  let wanted: Wish<T> | null = null;
  let wantedSince = 0;
  /** The key that was told of last, and the order of the wish that it was. */
  let told: string | null = null;
  let toldOrder = 0;
  let order = 0;
  let running: readonly Running[] = [];
  let startedAt = -Infinity;
  /** After a failure: no fetch before this, and none of what failed before that. */
  let calmUntil = -Infinity;
  let retryAt = -Infinity;
  let failures = 0;
  let timer: ReturnType<typeof setTimeout> | undefined;
  const kept = new Map<string, { readonly value: T; readonly since: number }>();

  const end = (which: (each: Running) => boolean): void => {
    for (const each of running.filter(which)) each.abort.abort();
    running = running.filter((each) => !which(each));
  };

  const tell = (key: string, mine: number, value: T): void => {
    const isWanted = key === wanted?.key;
    if (mine < toldOrder && !isWanted) return;
    told = key;
    toldOrder = Math.max(toldOrder, mine);
    failures = 0;
    // Nobody waits any more for what was wanted before this.
    end((each) => each.order < mine && each.key !== wanted?.key);
    options.onValue(value);
  };

  const keep = (key: string, value: T): void => {
    kept.delete(key);
    kept.set(key, { value, since: now() });
    for (const oldest of kept.keys()) {
      if (kept.size <= MOST_KEPT) break;
      kept.delete(oldest);
    }
  };

  /** Starts what is wanted, or looks again when it may be started. */
  const pump = (): void => {
    clearTimeout(timer);
    if (!wanted || wanted.key === told) return;
    const { key } = wanted;
    const at = now();
    if (running.some((each) => each.key === key)) return;
    const notBefore = Math.max(calmUntil, retryAt, startedAt + PACE_MS);
    if (running.length >= MOST_RUNNING) {
      const settled = wantedSince + SETTLED_MS;
      if (at < settled) {
        timer = setTimeout(pump, settled - at);
        return;
      }
      end(() => true);
    }
    if (at < notBefore) {
      timer = setTimeout(pump, notBefore - at);
      return;
    }
    start(wanted);
  };

  const start = (wish: Wish<T>): void => {
    const abort = new AbortController();
    const mine = { key: wish.key, order: ++order, abort };
    running = [...running, mine];
    startedAt = now();
    const late = setTimeout(() => {
      abort.abort(new Error('no answer came in time'));
    }, TIMEOUT_MS);
    const isOver = (): boolean => {
      clearTimeout(late);
      const wasRunning = running.includes(mine);
      running = running.filter((each) => each !== mine);
      return !wasRunning;
    };
    wish.run(abort.signal).then(
      (value) => {
        if (isOver()) return;
        keep(wish.key, value);
        tell(wish.key, mine.order, value);
        pump();
      },
      (error: unknown) => {
        if (isOver()) return;
        const lasting = isLasting(error);
        const askedMs = error instanceof Refusal ? (error.retryAfterS ?? 0) * 1_000 : 0;
        calmUntil = now() + Math.max(CALM_MS, askedMs);
        // What nobody wants any more needs no second try.
        if (wanted?.key === wish.key) {
          if (lasting) told = wish.key;
          retryAt = now() + Math.min(RETRY_LONGEST_MS, RETRY_FIRST_MS * 2 ** failures);
          failures += 1;
          options.onError(error, lasting);
        }
        pump();
      },
    );
  };

  return {
    want: (wish) => {
      if (wish?.key === wanted?.key) return;
      wanted = wish;
      wantedSince = now();
      failures = 0;
      retryAt = -Infinity;
      if (!wish) {
        clearTimeout(timer);
        end(() => true);
        kept.clear();
        told = null;
        return;
      }
      const known = kept.get(wish.key);
      if (known && now() - known.since < KEEP_MS) {
        tell(wish.key, ++order, known.value);
        return;
      }
      pump();
    },
  };
}
