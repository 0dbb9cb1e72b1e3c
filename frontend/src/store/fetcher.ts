/**
 * Fetches what is wanted just now: the latest wish wins, nothing queues, and a failure is tried
 * again, ever more slowly.
 */
import { useEffect, useState } from 'react';

import { now } from '../clock';
import { Refusal } from '../contract/api';
import { failureText } from '../domain/format';

/** While somebody drags: a dozen starts a second, which a server of this kind allows. */
export const DRAG_PACE_MS = 80;
/** While somebody drags, so many at once: the next is on its way while one is being answered. */
const MOST_DRAGGED = 2;
/** A wish that has stood for so long is what the operator has come to; older fetches then end. */
const SETTLED_MS = 250;
const TIMEOUT_MS = 30_000;
/** While somebody drags, an answer serves again for so long: late readings may still change the past. */
const CACHE_MS = 30_000;
const MOST_CACHED = 60;
/** After a failure nothing is fetched for so long at least. */
const CALM_MS = 500;
const RETRY_FIRST_MS = 2_000;
const RETRY_LONGEST_MS = 30_000;
/** A server that wants to be left alone for longer is asked all the same. */
const CALM_LONGEST_MS = 60_000;

/** Something fetched beside the frames. While it is fetched again, the old value stays. */
export interface Fetched<T> {
  readonly value: T | null;
  readonly state: 'waiting' | 'ready' | 'failed';
  readonly message: string;
}

export const NOTHING: Fetched<never> = { value: null, state: 'waiting', message: '' };

export const ready = <T>(value: T): Fetched<T> => ({ value, state: 'ready', message: '' });

export const failed = <T>(message: string, value: T | null = null): Fetched<T> => ({
  ...{ value, state: 'failed', message },
});

export interface FetchTask<T> {
  /** What it depends on; a wish with the key of the one before brings nothing new. */
  readonly key: string;
  /** A wish of another group takes over at once; those of one group keep the pace. */
  readonly group?: string;
  /** In place of the fetcher's own pace, ms. */
  readonly paceMs?: number;
  readonly run: (signal: AbortSignal) => Promise<T>;
}

export interface FetcherOptions<T> {
  /** Shortest time between two starts, ms. */
  readonly paceMs: number;
  /** For a wish that somebody drags: two fetches at once, and answers that serve again. */
  readonly isDragged?: boolean;
  /** Something that was wanted, and nothing older than the value before. */
  readonly onValue: (value: T) => void;
  /** What is wanted cannot be had; unless `isLasting`, it is tried again. */
  readonly onError?: (message: string, isLasting: boolean) => void;
}

/** A refusal that the same request gets again. */
const isRefused = (error: unknown): boolean =>
  error instanceof Refusal && (error.status === 400 || error.status === 404);

export function createFetcher<T>({
  paceMs,
  isDragged = false,
  onValue,
  onError,
}: FetcherOptions<T>) {
  interface Running {
    readonly key: string;
    readonly order: number;
    readonly abort: AbortController;
  }
  let wanted: FetchTask<T> | null = null;
  let wantedSince = 0;
  /** The key whose value was handed on last, and the order of the wish that it was. */
  let done: string | null = null;
  let doneOrder = 0;
  let order = 0;
  let running: readonly Running[] = [];
  let startedAt = -Infinity;
  /** After a failure: no fetch before this, and none of what failed before that. */
  let calmUntil = -Infinity;
  let retryAt = -Infinity;
  let failures = 0;
  let timer: ReturnType<typeof setTimeout> | undefined;
  const cached = new Map<string, { readonly value: T; readonly since: number }>();

  const end = (which: (each: Running) => boolean = () => true): void => {
    for (const each of running.filter(which)) each.abort.abort();
    running = running.filter((each) => !which(each));
  };

  const handOn = (key: string, mine: number, value: T): void => {
    if (mine < doneOrder && key !== wanted?.key) return;
    done = key;
    doneOrder = Math.max(doneOrder, mine);
    failures = 0;
    // Nobody waits any more for what was wanted before this.
    end((each) => each.order < mine && each.key !== wanted?.key);
    onValue(value);
  };

  const cache = (key: string, value: T): void => {
    cached.delete(key);
    cached.set(key, { value, since: now() });
    for (const oldest of cached.keys()) {
      if (cached.size <= MOST_CACHED) break;
      cached.delete(oldest);
    }
  };

  /** Starts what is wanted, or looks again when it may be started. */
  const pump = (): void => {
    clearTimeout(timer);
    if (!wanted || wanted.key === done) return;
    const { key } = wanted;
    const at = now();
    if (running.some((each) => each.key === key)) return;
    if (running.length >= (isDragged ? MOST_DRAGGED : 1)) {
      // What keeps the pace waits for its answer.
      if (!isDragged) return;
      const settled = wantedSince + SETTLED_MS;
      if (at < settled) {
        timer = setTimeout(pump, settled - at);
        return;
      }
      end();
    }
    const notBefore = Math.max(calmUntil, retryAt, startedAt + (wanted.paceMs ?? paceMs));
    if (at < notBefore) timer = setTimeout(pump, notBefore - at);
    else start(wanted);
  };

  const start = (task: FetchTask<T>): void => {
    const abort = new AbortController();
    const mine = { key: task.key, order: ++order, abort };
    running = [...running, mine];
    startedAt = now();
    const late = setTimeout(() => {
      abort.abort(new Refusal(504, 'no answer came in time'));
    }, TIMEOUT_MS);
    const isOver = (): boolean => {
      clearTimeout(late);
      const wasRunning = running.includes(mine);
      running = running.filter((each) => each !== mine);
      return !wasRunning;
    };
    task.run(abort.signal).then(
      (value) => {
        if (isOver()) return;
        if (isDragged) cache(task.key, value);
        handOn(task.key, mine.order, value);
        pump();
      },
      (error: unknown) => {
        if (isOver()) return;
        const isLasting = isDragged && isRefused(error);
        const waitMs = error instanceof Refusal ? (error.retryAfterS ?? 0) * 1_000 : 0;
        calmUntil = now() + Math.min(CALM_LONGEST_MS, Math.max(CALM_MS, waitMs));
        // What nobody wants any more needs no second try.
        if (wanted?.key === task.key || !isDragged) {
          if (isLasting) done = task.key;
          retryAt = now() + Math.min(RETRY_LONGEST_MS, RETRY_FIRST_MS * 2 ** failures);
          failures += 1;
          onError?.(failureText(error), isLasting);
        }
        pump();
      },
    );
  };

  return {
    /** Null: nothing any more; all that is under way ends. */
    want: (task: FetchTask<T> | null): void => {
      if (task?.key === wanted?.key && task?.group === wanted?.group) return;
      const isOther = !task || task.group !== wanted?.group;
      wanted = task;
      wantedSince = now();
      if (isOther || isDragged) {
        failures = 0;
        retryAt = -Infinity;
      }
      if (isOther) {
        clearTimeout(timer);
        end();
        cached.clear();
        done = null;
        startedAt = -Infinity;
      }
      if (!task) return;
      const known = cached.get(task.key);
      if (known && now() - known.since < CACHE_MS) handOn(task.key, ++order, known.value);
      else pump();
    },
  };
}

/**
 * What a component wishes for just now; null: nothing more. The value before stays until the next
 * has come, also that of another group: "waiting" then.
 */
export function useFetched<T>(task: FetchTask<T> | null, paceMs: number): Fetched<T> {
  const [fetched, setFetched] = useState<Fetched<T>>(NOTHING);
  const [group, setGroup] = useState(task?.group);
  const [fetcher] = useState(() =>
    createFetcher<T>({
      paceMs,
      onValue: (value) => {
        setFetched(ready(value));
      },
      onError: (message) => {
        setFetched(({ value }) => failed(message, value));
      },
    }),
  );
  if (task && task.group !== group) {
    setGroup(task.group);
    setFetched(({ value }) => ({ value, state: 'waiting', message: '' }));
  }
  // The same wish as before changes nothing.
  useEffect(() => {
    fetcher.want(task);
  });
  useEffect(
    () => () => {
      fetcher.want(null);
    },
    [fetcher],
  );
  return fetched;
}
