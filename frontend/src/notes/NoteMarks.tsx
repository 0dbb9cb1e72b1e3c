/** The journal's notes, fetched whenever their number grows, and their marks above a time axis. */
import { type JSX, useMemo } from 'react';

import { fetchNotes } from '../contract/people';
import type { Alarm, Note } from '../contract/types';
import { shown } from '../domain/text';
import { rosText, type Span } from '../domain/time';
import { act, keepFetched, useApp } from '../store/app';
import { createStore, PAGE, useSelected } from '../store/create';
import { LANGUAGE, S } from '../strings';
import { NOTES } from '../words/notes';

export type StandingNote = ReturnType<typeof standing>[number];

/** Notes that were not withdrawn, the oldest moment first. */
export const standingNotes = createStore<readonly StandingNote[]>([]);

export const standing = (notes: readonly Note[]) =>
  notes
    .filter(({ withdrawn_by: by }) => by === null)
    .map(({ id, kind, subject, text, by, made_at: made, until }) => ({
      ...{ id, kind, subject, by, text: text.replace(/\s+/g, ' ') },
      /** The time that the note is about, ROS seconds. */
      at: (kind === 'comment' ? until : null) ?? made,
      /** End of a `shelve`, ROS seconds; null: the alarm was unshelved. */
      until,
    }))
    .reverse()
    .sort((one, other) => one.at - other.at);

const PACE_MS = 500;

export const startNotes = (signal = PAGE): void =>
  keepFetched<readonly Note[]>(
    {
      paceMs: PACE_MS,
      onValue: (notes) => standingNotes.set(standing(notes)),
    },
    ({ twin: { alarms, connection } }) =>
      // A journal without notes needs no request.
      alarms?.notes ? { key: `${connection.epoch}|${alarms.notes}`, run: fetchNotes } : undefined,
    signal,
  );

/** Marks closer than this share of the span would overlap. */
const NEAR = 0.02;

/** Clusters of notes that share one mark; sorted from the oldest, like `found`. */
export function clustersOf(found: readonly StandingNote[], { from, to }: Span) {
  const clusters: { at: number; notes: StandingNote[] }[] = [];
  for (const one of found) {
    const { at } = one;
    if (at < from || at > to) continue;
    const last = clusters.at(-1);
    if (last && at - last.at < NEAR * (to - from)) last.notes.push(one);
    else clusters.push({ at, notes: [one] });
  }
  return clusters;
}

export const C = NOTES[LANGUAGE];

/** The tag of a note's subject; null: the greenhouse, or an alarm unknown to the page. */
function tagIdOf(subject: string, alarms: readonly Alarm[]): string | null {
  const [kind, ...rest] = subject.split(':');
  const id = rest.join(':');
  if (kind === 'tag') return id;
  if (kind !== 'alarm') return null;
  return alarms.find((alarm) => alarm.id === id)?.tag_id || null;
}

/** "Tag 7", "alarm at Tag 7", "greenhouse". */
function subjectText(subject: string, alarms: readonly Alarm[]): string {
  if (subject === 'site') return C.site;
  const tagId = tagIdOf(subject, alarms);
  const tag = tagId === null ? '' : S.card(shown(tagId, 24));
  return subject.startsWith('alarm:') ? C.alarm(tag) : tag;
}

function noteText({ kind, text, until }: StandingNote): string {
  if (kind === 'comment') return text;
  const shelved = until === null ? C.unshelved : S.alarmShelved(rosText(until), '', '');
  const what = kind === 'acknowledge' ? S.healthAcknowledged : shelved;
  return text === '' ? what : `${what}: ${text}`;
}

/** Most notes in the text of one mark. */
const MOST_NOTES = 5;
const LONGEST = 160;
const NO_ALARMS = [] as const;

/** Marks above a time axis: who commented, acknowledged or shelved what; a click goes to that moment. */
export function NoteMarks({
  span,
  tagIds,
}: {
  span: Span;
  /** Limits the notes to these tags and the greenhouse; undefined: all. */
  tagIds?: readonly string[];
}): JSX.Element | null {
  const all = useSelected(standingNotes);
  const alarms = useApp((state) => state.twin.alarms?.alarms ?? NO_ALARMS);
  const { from, to } = span;
  const ids = tagIds?.join('\u0001');
  const clusters = useMemo(() => {
    const wanted = ids === undefined ? null : new Set(ids.split('\u0001'));
    const found = all.filter(({ subject }) => {
      const tagId = tagIdOf(subject, alarms);
      return wanted === null || (tagId === null ? subject === 'site' : wanted.has(tagId));
    });
    return clustersOf(found, { from, to });
  }, [all, alarms, ids, from, to]);
  if (clusters.length === 0) return null;
  return (
    <ul className="comment-marks" aria-label={C.title}>
      {clusters.map(({ at, notes: found }) => {
        const share = (at - from) / (to - from);
        const texts = found.slice(-MOST_NOTES).map((one) => (
          <span key={one.id}>
            <bdi>{one.by}</bdi>, {rosText(one.at)}, <bdi>{subjectText(one.subject, alarms)}</bdi>:{' '}
            <bdi>{shown(noteText(one), LONGEST)}</bdi>
          </span>
        ));
        return (
          <li key={found[0]?.id} style={{ left: `${100 * share}%` }}>
            <button type="button" onClick={() => act({ moment: at })}>
              <svg viewBox="0 0 16 16" width="14" height="14" aria-hidden="true">
                <path d="M2 2h12v9H8l-4 4v-4H2z" />
              </svg>
              <span className="comment-text" data-side={share > 0.5 ? 'before' : 'after'}>
                {texts}
                {found.length > texts.length && (
                  <span>{S.attentionMore(found.length - texts.length)}</span>
                )}
              </span>
            </button>
          </li>
        );
      })}
    </ul>
  );
}
