import { fetchHistory } from '../contract/api';
import type { TagHistory, WireTime } from '../contract/types';
import { secondsOf } from '../domain/time';
import { memoLast } from '../domain/memo';
import { useFetched } from '../store/useFetched';

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

/** Whoever stands at a tag that is scanned over and over does not ask each time, ms. */
const PACE_MS = 500;

/** The last scans of a tag, fetched anew after each observation; null until they are here. */
export function useHistory(tagId: string, observation: string | undefined): TagHistory | null {
  const { value } = useFetched<TagHistory>(
    // A tag that a link names and the twin does not know.
    observation === undefined
      ? null
      : { key: observation, group: tagId, run: (signal) => fetchHistory(tagId, signal) },
    PACE_MS,
  );
  return value?.tag_id === tagId ? value : null;
}
