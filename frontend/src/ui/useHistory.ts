import { useEffect, useState } from 'react';

import { fetchHistory } from '../contract/api';
import type { TagHistory, WireTime } from '../contract/types';
import { secondsOf } from '../domain/rostime';
import { memoLast } from '../store/memo';

/** Of the last scans and tries those that had been made by then, ROS seconds; null: now. */
export const asOf = memoLast((history: TagHistory, moment: number | null): TagHistory => {
  if (moment === null) return history;
  const wasMade = ({ stamp }: { readonly stamp: WireTime }): boolean => secondsOf(stamp) <= moment;
  return {
    ...history,
    tries: history.tries.filter(wasMade),
    sensors: history.sensors.map(({ name, values }) => ({ name, values: values.filter(wasMade) })),
  };
});

/** The last scans of a tag, fetched anew after each observation; null until they are here. */
export function useHistory(tagId: string, observation: string | undefined): TagHistory | null {
  const [history, setHistory] = useState<TagHistory | null>(null);
  useEffect(() => {
    // A tag that a link names and the twin does not know.
    if (observation === undefined) return undefined;
    const abort = new AbortController();
    fetchHistory(tagId, abort.signal).then(setHistory, () => {
      // The card does without: history is an extra, and the next observation asks again.
    });
    return () => {
      abort.abort();
    };
  }, [tagId, observation]);
  return history?.tag_id === tagId ? history : null;
}
