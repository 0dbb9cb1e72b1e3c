import { useEffect, useState } from 'react';

import { createFetcher, failed, type Fetched, NOTHING, ready, type Wish } from './fetcher';

/**
 * What a component wishes for just now; null: nothing more. The value before stays until the next
 * has come, also that of another group: "waiting" then.
 */
export function useFetched<T>(wish: Wish<T> | null, paceMs: number): Fetched<T> {
  const [fetched, setFetched] = useState<Fetched<T>>(NOTHING);
  const [group, setGroup] = useState(wish?.group);
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
  if (wish && wish.group !== group) {
    setGroup(wish.group);
    setFetched(({ value }) => ({ value, state: 'waiting', message: '' }));
  }
  // The same wish as before changes nothing.
  useEffect(() => {
    fetcher.want(wish);
  });
  useEffect(
    () => () => {
      fetcher.want(null);
    },
    [fetcher],
  );
  return fetched;
}
