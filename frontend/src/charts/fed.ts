/** What charts have to show: what was fetched, and what was heard since. Pure. */
import type { TwinTagState } from '../contract/types';
import { secondsOf } from '../domain/rostime';
import { goneOn } from '../domain/series';
import type { Span } from '../domain/period';
import type { Mark, Reading, Series } from '../domain/series';

/** One line of a chart. */
export interface Pair {
  readonly tagId: string;
  readonly sensor: string;
}

export const pairKey = ({ tagId, sensor }: Pair): string => `${sensor}\u0000${tagId}`;

/** By `pairKey`, and marks by tag, as the server told them. */
export interface Fetched {
  /** Up to when there was something to tell of, ROS seconds: the last bucket may end later. */
  readonly until: number;
  readonly series: ReadonlyMap<string, Series>;
  readonly marks: ReadonlyMap<string, readonly Mark[]>;
  /** By `pairKey`, the day before, a day later than it was; empty: nobody asked for it. */
  readonly before: ReadonlyMap<string, Series>;
}

export interface Fed extends Fetched {
  /** "missing": this twin keeps no past. While it is fetched again, what was there stays. */
  readonly state: 'waiting' | 'ready' | 'failed' | 'missing';
  /** Why there is nothing, for a person to read. */
  readonly message: string;
  /** Newer than what was fetched, by the same keys. */
  readonly heard: ReadonlyMap<string, readonly Reading[]>;
  readonly heardMarks: ReadonlyMap<string, readonly Mark[]>;
}

export const NOTHING_FED: Fed = {
  until: 0,
  series: new Map(),
  marks: new Map(),
  before: new Map(),
  state: 'waiting',
  message: '',
  heard: new Map(),
  heardMarks: new Map(),
};

/** The server tells of it long before; who hears more than this between two answers loses the oldest. */
const MOST_HEARD = 5_000;

/**
 * Up to when a line is told of by its answer. What the journal was about to write is not in it yet.
 * What of it went into the last bucket nobody knows; the next answer does.
 */
function toldUntil({ series, until }: Fetched, key: string): number {
  const line = series.get(key);
  return line?.readings.at(-1)?.at ?? (line?.bucketS ? until : -Infinity);
}

/** Takes an answer. What was heard and is not in it yet stays. */
export function withFetched(fed: Fed, fetched: Fetched): Fed {
  const heard = new Map<string, readonly Reading[]>();
  for (const [key, readings] of fed.heard) {
    const told = toldUntil(fetched, key);
    const later = readings.filter(({ at }) => at > told);
    if (later.length > 0) heard.set(key, later);
  }
  const heardMarks = new Map<string, readonly Mark[]>();
  return { ...fed, ...fetched, heard, heardMarks, state: 'ready', message: '' };
}

/** Leaves what is of these lines; it is shown until the answer to another question is here. */
export function withOnly(fed: Fed, pairs: readonly Pair[]): Fed {
  const keys = new Set(pairs.map(pairKey));
  const tags = new Set(pairs.map(({ tagId }) => tagId));
  const only = <T>(map: ReadonlyMap<string, T>, kept: ReadonlySet<string>): Map<string, T> =>
    new Map([...map].filter(([key]) => kept.has(key)));
  return {
    ...fed,
    series: only(fed.series, keys),
    heard: only(fed.heard, keys),
    marks: only(fed.marks, tags),
    before: only(fed.before, keys),
    heardMarks: only(fed.heardMarks, tags),
    state: 'waiting',
    message: '',
  };
}

/** Takes a state of the twin; the same object if it brings nothing new of these lines. */
export function withState(fed: Fed, pairs: readonly Pair[], tags: readonly TwinTagState[]): Fed {
  const byId = new Map(tags.map((tag) => [tag.tag_id, tag]));
  let { heard, heardMarks } = fed;
  for (const pair of pairs) {
    const tag = byId.get(pair.tagId);
    if (!tag) continue;
    const key = pairKey(pair);
    const reading = readingOf(tag, pair.sensor);
    const last = heard.get(key)?.at(-1)?.at ?? toldUntil(fed, key);
    if (reading && reading.at > last) heard = appended(heard, key, [reading]);
    const known = [...(fed.marks.get(pair.tagId) ?? []), ...(heardMarks.get(pair.tagId) ?? [])];
    const marks = marksIn(tag).filter((mark) => !known.some((other) => isTold(other, mark)));
    if (marks.length > 0) heardMarks = appended(heardMarks, pair.tagId, marks);
  }
  return heard === fed.heard && heardMarks === fed.heardMarks ? fed : { ...fed, heard, heardMarks };
}

function appended<T>(
  map: ReadonlyMap<string, readonly T[]>,
  key: string,
  more: readonly T[],
): ReadonlyMap<string, readonly T[]> {
  return new Map(map).set(key, [...(map.get(key) ?? []), ...more].slice(-MOST_HEARD));
}

function readingOf(tag: TwinTagState, sensor: string): Reading | null {
  const reading = tag.readings.find(({ name }) => name === sensor);
  // A twin that does not tell when it was made: the server will know more.
  if (!reading?.observed_at) return null;
  return { at: secondsOf(reading.observed_at), value: reading.value };
}

function marksIn({
  last_try: tried,
  last_try_status: status,
  looked_at: looked,
}: TwinTagState): Mark[] {
  const marks: Mark[] = [];
  if (looked) marks.push({ at: secondsOf(looked), widthS: 0, kind: 'look', count: 1 });
  if (tried && status) marks.push({ at: secondsOf(tried), widthS: 0, kind: 'failure', count: 1 });
  return marks;
}

const isTold = (known: Mark, mark: Mark): boolean =>
  known.kind === mark.kind && mark.at >= known.at && mark.at <= known.at + known.widthS;

/** A line over a span that may have moved since it was fetched; null: not here yet. */
export function seriesOver(fed: Fed, pair: Pair, span: Span): Series | null {
  const key = pairKey(pair);
  const series = fed.series.get(key);
  return series ? goneOn(series, fed.heard.get(key) ?? [], span) : null;
}

export function marksOver(fed: Fed, tagId: string, { from, to }: Span): readonly Mark[] {
  return [...(fed.marks.get(tagId) ?? []), ...(fed.heardMarks.get(tagId) ?? [])].filter(
    ({ at, widthS }) => at + widthS >= from && at < to,
  );
}
