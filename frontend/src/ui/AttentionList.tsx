import { useRef, type CSSProperties, type JSX } from 'react';

import { byCause, tagsText } from '../alarms/arrange';
import { selectSpeech } from '../alarms/speech';
import type { HealthReason } from '../contract/types';
import { type HouseHealth, isBad, severity, todoText } from '../domain/health';
import { shown } from '../domain/text';
import { useApp } from '../store/app';
import { selectHealth } from '../store/derived';
import { selectIsHere } from '../store/moment';
import { S } from '../strings';
import { useSince, useUrgent, type Urgent } from './DoNow';
import { useFitting } from './fitting';
import { HealthMark } from './HealthMark';
import { Reasons, useReasonText } from './Reasons';

/** Lines that a screen on the wall may have room for. */
const MOST_LINES = 40;
/** More tags than this stand by their causes. */
const MANY_TAGS = 12;
/** Of each tag. */
const MOST_REASONS = 2;

interface Line {
  readonly key: string;
  /** Null: it is of one tag. */
  readonly cause: string | null;
  readonly tags: readonly [Urgent, ...Urgent[]];
}

/** For a wall screen: the tags that need somebody, in the order of `useUrgent`. */
export function AttentionList(): JSX.Element {
  const urgent = useUrgent();
  const lines = useLines(urgent);
  const health = useApp(selectHealth);
  const isHere = useApp(selectIsHere);
  const heading = urgent.length > 0 ? S.attention : isHere ? noneText(health) : null;
  const list = useRef<HTMLUListElement>(null);
  const count = useFitting(list, lines.length);
  const rest = lines.slice(count).reduce((sum, { tags }) => sum + tags.length, 0);
  return (
    <div className="attention">
      {heading && <h3>{heading}</h3>}
      <ul ref={list} style={{ '--rows': lines.length } as CSSProperties}>
        {lines
          .slice(0, MOST_LINES)
          .map(({ key, cause, tags }, index) =>
            cause === null ? (
              <TagLine key={key} of={tags[0]} fits={index < count} />
            ) : (
              <CauseLine key={key} cause={cause} tags={tags} fits={index < count} />
            ),
          )}
      </ul>
      {rest > 0 && <p className="attention-more">{S.attentionMore(rest)}</p>}
    </div>
  );
}

/** A line for each tag; of many, one for what ails more than a few of them. */
function useLines(urgent: readonly Urgent[]): readonly Line[] {
  const speech = useApp(selectSpeech);
  const ofOne = (each: Urgent): Line => ({ key: each.tagId, cause: null, tags: [each] });
  if (urgent.length <= MANY_TAGS) return urgent.map(ofOne);
  const wrong = urgent.map((own) => ({
    own,
    alarm: { id: own.tagId, tag_id: own.tagId, reason: own.reasons[0] },
  }));
  return byCause(wrong, speech).flatMap(({ key, cause, items }): Line[] => {
    const [first, ...others] = items.map(({ own }) => own);
    if (!first) return [];
    return cause === null
      ? [first, ...others].map(ofOne)
      : [{ key, cause, tags: [first, ...others] }];
  });
}

function TagLine({ of: { tagId, reasons }, fits }: { of: Urgent; fits: boolean }): JSX.Element {
  const [{ verdict }] = reasons;
  const since = useSince(tagId, reasons[0]);
  return (
    <li data-fits={fits} data-tag-id={tagId} data-health={verdict}>
      <strong>
        <bdi>{shown(tagId, 16)}</bdi>
      </strong>
      <span className="attention-why">
        <Reasons health={{ verdict, reasons }} most={MOST_REASONS} />
        <span className="attention-do">
          <Todo reasons={reasons.slice(0, MOST_REASONS)} /> <small className="faint">{since}</small>
        </span>
      </span>
    </li>
  );
}

/** What ails many tags, what to do about it, where it is worst, and at which tags. */
function CauseLine({
  cause,
  tags,
  fits,
}: {
  cause: string;
  tags: Line['tags'];
  fits: boolean;
}): JSX.Element {
  const badness = ({ reasons: [reason] }: Urgent): number =>
    severity({ verdict: reason.verdict, reasons: [reason] });
  const worst = tags.reduce((a, b) => (badness(b) > badness(a) ? b : a));
  const [reason] = worst.reasons;
  const why = S.healthDriver(shown(worst.tagId, 16), useReasonText(reason, true));
  const since = useSince(worst.tagId, reason);
  return (
    <li data-fits={fits} data-cause={cause} data-health={reason.verdict}>
      <HealthMark verdict={reason.verdict} word={false} />
      <span className="attention-why">
        {cause}: {S.shownOf(tags.length, tags.length)}
        <span className="attention-do">
          <Todo reasons={tags.map(({ reasons }) => reasons[0])} />{' '}
          <small className="faint">
            {why}
            {since && ` · ${since}`} · {tagsText(tags.map(({ tagId }) => tagId))}
          </small>
        </span>
      </span>
    </li>
  );
}

/** What to do about each of them, no word twice; of some nothing. */
function Todo({ reasons }: { reasons: readonly HealthReason[] }): JSX.Element | null {
  const texts = [...new Set(reasons.map(todoText))].filter(Boolean);
  return texts.length > 0 ? <strong>{texts.join(' · ')}</strong> : null;
}

/** Null: all of it is shelved, or the greenhouse's own reason says more. */
function noneText({ verdict, reasons, counts: { unknown } }: HouseHealth): string | null {
  if (isBad(verdict) || reasons.length > 0) return null;
  // Of whom nothing is known, nobody knows that he needs nothing.
  return unknown > 0 ? S.attentionNoneKnown(unknown) : S.attentionNone;
}
