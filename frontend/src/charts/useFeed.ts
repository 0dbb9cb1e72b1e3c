import { useEffect, useState, useSyncExternalStore } from 'react';

import { spanOf, type Span } from '../domain/period';
import { store, useApp } from '../store/app';
import { rosNow, selectNewest } from '../store/moment';
import { selectDayS } from '../store/origin';
import { useNow } from '../widgets/useNow';
import { pairKey, type Fed, type Pair } from './fed';
import { createFeed } from './feed';

export interface Feeding {
  readonly fed: Fed;
  /** The period of the time bar; null while nobody knows what time it is. */
  readonly span: Span | null;
}

/** What these lines have over the period of the time bar, kept up to date while it is looked at. */
export function useFeed(pairs: readonly Pair[], points: number, hasDayBefore = false): Feeding {
  const [feed] = useState(createFeed);
  const fed = useSyncExternalStore(feed.subscribe, feed.get);
  const period = useApp((state) => state.view.period);
  const remembered = useApp((state) => state.twin.remembered);
  const epoch = useApp((state) => state.twin.connection.epoch);
  const dayS = useApp(selectDayS);
  const isOpen = useApp((state) => state.twin.connection.socket.kind === 'open');
  const nowS = rosNow(store.get(), useNow());
  const isOff = remembered.state === 'off';
  const oldest = remembered.value?.reach?.from ?? null;
  const span = nowS === null ? null : spanOf(period, nowS, oldest);
  const wanted = pairs.map(pairKey).join('\u0001');

  // With each tick: what there is nothing new of is not asked for.
  useEffect(() => {
    if (!span || nowS === null || isOff || !isOpen || points === 0) return;
    feed.want({
      ...{ pairs, span, nowS, points, epoch },
      period: JSON.stringify(period),
      dayS: hasDayBefore ? dayS : null,
    });
  });

  useEffect(() => {
    const hear = (): void => {
      const { snapshot } = selectNewest(store.get());
      if (snapshot) feed.hear(snapshot.tags.map(({ wire }) => wire));
    };
    hear();
    let before = selectNewest(store.get()).snapshot?.tags;
    return store.subscribe(() => {
      const tags = selectNewest(store.get()).snapshot?.tags;
      if (tags !== before) hear();
      before = tags;
    });
  }, [feed, wanted]);

  useEffect(
    () => () => {
      feed.want(null);
    },
    [feed],
  );

  return {
    fed: isOff ? { ...fed, state: 'missing', message: remembered.message } : fed,
    span,
  };
}
