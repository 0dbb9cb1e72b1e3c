import { useEffect, useState } from 'react';

import { fetchHistory } from '../contract/api';
import type { TagHistory } from '../contract/types';

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
