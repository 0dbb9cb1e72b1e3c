/** The comments of the log: fetched whenever the bridge says that there are more notes. */
import { type JSX, useMemo } from 'react';

import { fetchComments } from '../contract/people';
import type { Alarm, Note } from '../contract/types';
import { shown } from '../domain/text';
import { rosText, secondsOf, type Span } from '../domain/time';
import { act, store, useApp } from '../store/app';
import { createStore, useSelected } from '../store/create';
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

/** Comments that the text of one mark holds. */
const MOST_TOLD = 5;
/** Characters of each. */
const LONGEST = 160;
const NO_ALARMS = [] as const;

/** Above a time axis: who said something about when. A click goes to that moment. */
export function CommentMarks({
  span,
  tagIds,
}: {
  span: Span;
  /** Of these tags and of the greenhouse; none: all. */
  tagIds?: readonly string[];
}): JSX.Element | null {
  const all = useSelected(comments, (it) => it);
  const alarms = useApp((state) => state.twin.alarms?.alarms ?? NO_ALARMS);
  const { from, to } = span;
  const ids = tagIds?.join('\u0001');
  const clusters = useMemo(() => {
    const wanted = ids === undefined ? null : new Set(ids.split('\u0001'));
    const found = all.filter(({ subject }) => {
      const tagId = tagOf(subject, alarms);
      return wanted === null || (tagId === null ? subject === 'site' : wanted.has(tagId));
    });
    return clustersOf(found, { from, to });
  }, [all, alarms, ids, from, to]);
  if (clusters.length === 0) return null;
  return (
    <ul className="comment-marks" aria-label={C.title} data-testid="comment-marks">
      {clusters.map(({ at, comments: found }) => {
        const share = (at - from) / (to - from);
        const told = found.slice(-MOST_TOLD).map(({ id, by, subject, text, at: when }) => (
          <span key={id}>
            <bdi>{by}</bdi>, {rosText(when)}, <bdi>{subjectText(subject, alarms)}</bdi>:{' '}
            <bdi>{shown(text, LONGEST)}</bdi>
          </span>
        ));
        return (
          <li key={found[0]?.id} style={{ left: `${100 * share}%` }} data-at={at}>
            <button
              type="button"
              onClick={() => {
                act({ type: 'moment', moment: at });
              }}
            >
              <svg viewBox="0 0 16 16" width="14" height="14" aria-hidden="true">
                <path d="M2 2h12v9H8l-4 4v-4H2z" />
              </svg>
              <span className="comment-text" data-side={share > 0.5 ? 'before' : 'after'}>
                {told}
                {found.length > told.length && <span>{C.more(found.length - told.length)}</span>}
              </span>
            </button>
          </li>
        );
      })}
    </ul>
  );
}
