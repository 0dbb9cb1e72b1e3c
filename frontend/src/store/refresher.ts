import { now } from '../clock';

/** One thing to fetch. */
export interface Task<T> {
  /** What it depends on; a task with the key of the one before has nothing new to bring. */
  readonly key: string;
  /** Tasks of one group follow each other calmly; one of another group takes over at once. */
  readonly group: string;
  /** Shortest time between the starts of two fetches of its group, if not the usual. */
  readonly intervalMs?: number;
  readonly run: (signal: AbortSignal) => Promise<T>;
}

export interface RefresherOptions<T> {
  /** Shortest time between the starts of two fetches of one group. */
  readonly intervalMs: number;
  readonly onValue: (value: T) => void;
  /** Told of a failure; the fetch is then tried again, ever more slowly. */
  readonly onError: (error: unknown) => void;
}

const RETRY_FIRST_MS = 2_000;
const RETRY_LONGEST_MS = 30_000;

export interface Refresher<T> {
  /** Brings the newest of what is wanted; null: nothing is wanted any more. */
  readonly want: (task: Task<T> | null) => void;
}

/**
 * Keeps one fetched thing up to date: at most one fetch at a time, never a queue. A house that
 * changes ten times a second costs one fetch an interval, and the last change is always fetched.
 */
export function createRefresher<T>(options: RefresherOptions<T>): Refresher<T> {
  let wanted: Task<T> | null = null;
  let running: { readonly task: Task<T>; readonly abort: AbortController } | null = null;
  let done: string | null = null;
  let startedAt = -Infinity;
  let failures = 0;
  let timer: ReturnType<typeof setTimeout> | undefined;

  const stop = (): void => {
    running?.abort.abort();
    running = null;
    clearTimeout(timer);
  };

  const schedule = (): void => {
    clearTimeout(timer);
    if (running || !wanted || wanted.key === done) return;
    const pause =
      failures === 0
        ? (wanted.intervalMs ?? options.intervalMs)
        : Math.min(RETRY_LONGEST_MS, RETRY_FIRST_MS * 2 ** (failures - 1));
    timer = setTimeout(start, Math.max(0, startedAt + pause - now()));
  };

  const start = (): void => {
    if (!wanted) return;
    const task = wanted;
    const abort = new AbortController();
    const mine = { task, abort };
    running = mine;
    startedAt = now();
    task.run(abort.signal).then(
      (value) => {
        if (running !== mine) return;
        running = null;
        failures = 0;
        done = task.key;
        options.onValue(value);
        schedule();
      },
      (error: unknown) => {
        if (running !== mine) return;
        running = null;
        failures += 1;
        options.onError(error);
        schedule();
      },
    );
  };

  return {
    want: (task) => {
      if (task?.key === wanted?.key) return;
      const takesOver = task?.group !== wanted?.group;
      wanted = task;
      if (!takesOver) {
        schedule();
        return;
      }
      stop();
      done = null;
      failures = 0;
      if (task) start();
    },
  };
}
