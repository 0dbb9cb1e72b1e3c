import { useMemo, type JSX } from 'react';

import { rosText, type Span } from '../domain/time';
import { shown } from '../domain/text';
import { act, useApp } from '../store/app';
import { useSelected } from '../store/create';
import { C, clustersOf, comments, subjectText, tagOf } from './comments';

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
