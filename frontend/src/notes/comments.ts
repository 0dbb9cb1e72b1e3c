/** The comments of the log: fetched whenever the bridge says that there are more notes. */
import { fetchComments } from '../contract/people';
import type { Alarm, Note } from '../contract/types';
import { shown } from '../domain/text';
import { secondsOf, type Span } from '../domain/time';
import { store } from '../store/app';
import { createStore } from '../store/create';
import { createFetcher } from '../store/fetcher';
import { LANGUAGE, S } from '../strings';
import { COMMENTS } from '../words/comments';

export interface Comment {
  readonly id: string;
  readonly subject: string;
  readonly text: string;
  readonly by: string;
  /** The moment that it is about, ROS seconds. */
  readonly at: number;
}

/** Those that stand, the oldest moment first. */
export const comments = createStore<readonly Comment[], readonly Comment[]>([], (_, next) => next);

export const commentsIn = (notes: readonly Note[]): Comment[] =>
  notes
    .filter(({ withdrawn_by: by }) => by === null)
    .map(({ id, subject, text, by, made_at: made, until }) => ({
      ...{ id, subject, by, at: secondsOf(until ?? made) },
      text: text.replace(/\s+/g, ' '),
    }))
    .reverse()
    .sort((one, other) => one.at - other.at);

const PACE_MS = 500;

export function startComments(): () => void {
  const fetcher = createFetcher<readonly Note[]>({
    paceMs: PACE_MS,
    onValue: (notes) => {
      comments.dispatch(commentsIn(notes));
    },
  });
  const update = (): void => {
    const { alarms, connection } = store.get().twin;
    // A log without notes is not asked for any.
    if (!alarms?.notes) return;
    fetcher.want({ key: `${connection.epoch}|${alarms.notes}`, run: fetchComments });
  };
  update();
  const stop = store.subscribe(update);
  return () => {
    stop();
    fetcher.want(null);
  };
}

/** Comments so near to each other that one mark stands for them. */
interface Cluster {
  readonly at: number;
  readonly comments: readonly Comment[];
}

/** Nearer than this, as a share of the span, marks would cover each other. */
const NEAR = 0.02;

/** From the oldest; `found` is in that order. */
export function clustersOf(found: readonly Comment[], { from, to }: Span): Cluster[] {
  const clusters: { at: number; comments: Comment[] }[] = [];
  for (const comment of found) {
    const { at } = comment;
    if (at < from || at > to) continue;
    const last = clusters.at(-1);
    if (last && at - last.at < NEAR * (to - from)) last.comments.push(comment);
    else clusters.push({ at, comments: [comment] });
  }
  return clusters;
}

export const C = COMMENTS[LANGUAGE];

/** Which tag a comment is about; null: the greenhouse, or an alarm that the page does not know. */
export function tagOf(subject: string, alarms: readonly Alarm[]): string | null {
  const [kind, id] = [
    subject.slice(0, subject.indexOf(':')),
    subject.slice(subject.indexOf(':') + 1),
  ];
  if (kind === 'tag') return id;
  if (kind !== 'alarm') return null;
  return alarms.find((alarm) => alarm.id === id)?.tag_id || null;
}

/** "Tag 7", "alarm at Tag 7", "greenhouse". */
export function subjectText(subject: string, alarms: readonly Alarm[]): string {
  if (subject === 'site') return C.site;
  const tagId = tagOf(subject, alarms);
  const tag = tagId === null ? '' : S.card(shown(tagId, 24));
  return subject.startsWith('alarm:') ? C.alarm(tag) : tag;
}
