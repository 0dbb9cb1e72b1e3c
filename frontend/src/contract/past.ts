/** The routes of the past: the state at a moment, and what happened when. Times are ROS seconds. */
import { answer, bodyOf, get, momentParameter, route, withQuery } from './api';
import { filledHealth, filledTag } from './frames';
import type { History, Latest, Schemas, Timeline } from './types';

/** Stamps are exact to the nanosecond, requested moments to the millisecond. */
const SAME_MOMENT_S = 0.0005;

/** Every tag at a moment, with the verdicts. */
export async function fetchStateAt(at: number, signal: AbortSignal): Promise<Latest> {
  const query = { at: momentParameter(at) };
  let isWhole = true;
  // Both or neither: no moment shows the verdicts of another one.
  const [state, health] = await Promise.all([
    get(withQuery('api/state', query), signal).then((it) => {
      isWhole = holdsAll(it, at);
      return bodyOf<Schemas['TwinState']>(it);
    }),
    answer<Schemas['Judgement']>(signal, 'api/health', ['house', 'tags'], query),
  ]);
  return {
    seq: 0,
    revision: `at ${state.header.stamp}`,
    state: { ...state, tags: state.tags.map(filledTag) },
    health: filledHealth(health),
    isWhole,
  };
}

/** Whether the journal is complete up to a moment; assumed if the server does not report it. */
function holdsAll({ headers }: Response, at: number): boolean {
  const complete = headers.get('X-Complete-To');
  const keptFrom = headers.get('X-Kept-From');
  return (
    (complete === null || Number(complete) >= at - SAME_MOMENT_S) &&
    (keptFrom === null || Number(keptFrom) <= at + SAME_MOMENT_S)
  );
}

/**
 * What happened over a period, in the given number of buckets; without a period, over the whole
 * history. With a tag, only what happened there.
 */
export const fetchTimeline = (
  span: { readonly from: number; readonly to: number } | null,
  points: number,
  signal: AbortSignal,
  tagId?: string,
): Promise<Timeline> =>
  answer(signal, 'api/timeline', ['buckets', 'silences', 'runs'], {
    points,
    from: span ? momentParameter(span.from) : undefined,
    to: span ? momentParameter(span.to) : undefined,
    tag_id: tagId,
  });

/** The server's limits. */
const MAX_POINTS = 5_000;

/** Times are ROS seconds. */
interface SeriesQuery {
  readonly tagId: string | undefined;
  readonly sensor: string | undefined;
  readonly from: number;
  readonly to: number;
}

const parameters = ({ tagId, sensor, from, to }: SeriesQuery) => ({
  tag_id: tagId,
  sensor_type: sensor,
  from: momentParameter(from),
  to: momentParameter(to),
});

export const fetchSeries = (
  query: SeriesQuery,
  points: number,
  signal: AbortSignal,
): Promise<History> =>
  answer(signal, 'api/history', ['readings', 'buckets', 'gaps'], {
    ...parameters(query),
    points: Math.min(MAX_POINTS, points),
  });

/** Address of every reading and attempt of a period, of one tag and sensor if given. */
export const exportAddress = (query: SeriesQuery): string =>
  route(withQuery('api/export.csv', parameters(query))).href;
