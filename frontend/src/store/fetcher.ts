/**
 * Fetches what is wanted now: the latest task wins, nothing queues, and failures are retried ever
 * more slowly.
 */
import { useEffect, useState } from 'react';

import { now } from '../clock';
import { Refusal } from '../contract/api';
import { failureText } from '../domain/format';

/** Pace while dragging: a dozen starts a second, which such a server allows. */
export const DRAG_PACE_MS = 80;
/** Concurrent fetches while dragging: one is sent while the other is being answered. */
const MOST_DRAGGED = 2;
/** After this long without change, the drag has settled; older fetches then end. */
const SETTLED_MS = 250;
const TIMEOUT_MS = 30_000;
/** Shortest pause after a failure. */
const CALM_MS = 500;
const RETRY_FIRST_MS = 2_000;
const RETRY_LONGEST_MS = 30_000;
/** Longest honoured `Retry-After`. */
const CALM_LONGEST_MS = 60_000;

/** Something fetched in addition to the frames. During a refetch, the old value stays. */
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
  /** What the result depends on; a task with the previous key changes nothing. */
  readonly key: string;
  /** A task of another group starts at once; tasks of one group keep the pace. */
  readonly group?: string;
  /** Overrides the fetcher's pace, ms. */
  readonly paceMs?: number;
  readonly run: (signal: AbortSignal) => Promise<T>;
}

export interface FetcherOptions<T> {
  /** Shortest time between two starts, ms. */
  readonly paceMs: number;
  /** For a dragged value: two concurrent fetches. */
  readonly isDragged?: boolean;
  /** Receives a wanted value, never older than the previous one. */
  readonly onValue: (value: T) => void;
  /** The fetch failed; unless `isLasting`, it is retried. */
  readonly onError?: (message: string, isLasting: boolean) => void;
}

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
  /** Key of the value handed on last, and the order of its task. */
  let done: string | null = null;
  let doneOrder = 0;
  let order = 0;
  let running: readonly Running[] = [];
  let startedAt = -Infinity;
  /** After a failure: no fetch before `calmUntil`, and no retry before `retryAt`. */
  let calmUntil = -Infinity;
  let retryAt = -Infinity;
  let failures = 0;
  let timer: ReturnType<typeof setTimeout> | undefined;

  const end = (which: (each: Running) => boolean = () => true): void => {
    for (const each of running.filter(which)) each.abort.abort();
    running = running.filter((each) => !which(each));
  };

  const handOn = (key: string, mine: number, value: T): void => {
    if (mine < doneOrder && key !== wanted?.key) return;
    done = key;
    doneOrder = Math.max(doneOrder, mine);
    failures = 0;
    // Nothing waits for earlier tasks any more.
    end((each) => each.order < mine && each.key !== wanted?.key);
    onValue(value);
  };

  /** Starts the wanted task, or schedules its start. */
  const pump = (): void => {
    clearTimeout(timer);
    if (!wanted || wanted.key === done) return;
    const { key } = wanted;
    const at = now();
    if (running.some((each) => each.key === key)) return;
    if (running.length >= (isDragged ? MOST_DRAGGED : 1)) {
      // Without dragging, the running fetch ends first.
      if (!isDragged) return;
      const settled = wantedSince + SETTLED_MS;
      if (at < settled) {
        timer = setTimeout(pump, settled - at);
        return;
      }
      end();
    }
    // A failure has a pace of its own: a long one would leave a chart empty for many seconds.
    const paced = failures > 0 ? retryAt : startedAt + (wanted.paceMs ?? paceMs);
    const notBefore = Math.max(calmUntil, paced);
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
        handOn(task.key, mine.order, value);
        pump();
      },
      (error: unknown) => {
        if (isOver()) return;
        // The same query would be refused again.
        const isLasting = isDragged && error instanceof Refusal && error.status === 400;
        const waitMs = error instanceof Refusal ? (error.retryAfterS ?? 0) * 1_000 : 0;
        calmUntil = now() + Math.min(CALM_LONGEST_MS, Math.max(CALM_MS, waitMs));
        // A task that is no longer wanted needs no retry.
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
    /** Null: nothing is wanted any more; running fetches end. */
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
        done = null;
        startedAt = -Infinity;
      }
      if (task) pump();
    },
  };
}

/**
 * Fetches what a component needs; null: nothing. The previous value stays until the next arrives;
 * of another group it is "waiting".
 */
export function useFetched<T>(task: FetchTask<T> | null, paceMs: number): Fetched<T> {
  const [fetched, setFetched] = useState<Fetched<T>>(NOTHING);
  const [group, setGroup] = useState(task?.group);
  const [fetcher] = useState(() =>
    createFetcher<T>({
      paceMs,
      onValue: (value) => setFetched(ready(value)),
      onError: (message) => {
        // A value of another group does not answer this one.
        setFetched(({ value, state }) => failed(message, state === 'waiting' ? null : value));
      },
    }),
  );
  if (task && task.group !== group) {
    setGroup(task.group);
    setFetched(({ value }) => ({ value, state: 'waiting', message: '' }));
  }
  // An unchanged task has no effect.
  useEffect(() => {
    fetcher.want(task);
  });
  useEffect(() => () => fetcher.want(null), [fetcher]);
  return fetched;
}
