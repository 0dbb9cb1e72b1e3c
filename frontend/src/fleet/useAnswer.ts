/** An answer of the server that is kept up to date while the page is looked at. */
import { useEffect, useState } from 'react';

import { bodyOf, get } from '../contract/api';

export interface Fetched<T> {
  /** The last one that came; null: none yet. */
  readonly value: T | null;
  /** Why there is no newer one; empty: there is. */
  readonly trouble: string;
}

/** What is asked for changes faster than anybody reads. */
const SETTLE_MS = 300;

/** Asks at once, when `path` or `news` is another, and every so many ms. */
export function useAnswer<T>(path: string, everyMs: number, news: unknown = null): Fetched<T> {
  const [fetched, setFetched] = useState<Fetched<T>>({ value: null, trouble: '' });
  useEffect(() => {
    const leaving = new AbortController();
    let timer: ReturnType<typeof setTimeout> | undefined;
    const ask = async (): Promise<void> => {
      try {
        if (document.visibilityState === 'visible') {
          const response = await get(path, leaving.signal);
          const value = await bodyOf<T>(response);
          setFetched({ value, trouble: '' });
        }
      } catch (error) {
        if (leaving.signal.aborted) return;
        const trouble = error instanceof Error ? error.message : String(error);
        setFetched(({ value }) => ({ value, trouble }));
      }
      if (!leaving.signal.aborted) timer = setTimeout(() => void ask(), everyMs);
    };
    timer = setTimeout(() => void ask(), SETTLE_MS);
    return () => {
      clearTimeout(timer);
      leaving.abort();
    };
  }, [path, everyMs, news]);
  return fetched;
}
