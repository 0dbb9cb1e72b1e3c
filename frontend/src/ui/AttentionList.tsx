import { useRef, type CSSProperties, type JSX } from 'react';

import type { HealthReason } from '../contract/types';
import { worstReason } from '../domain/health';
import { todoText } from '../domain/reasons';
import { shown } from '../domain/text';
import { useApp } from '../store/app';
import { selectHealth } from '../store/derived';
import { S } from '../strings';
import { useSince, useUrgent } from './DoNow';
import { useFitting } from './fitting';
import { Reasons } from './Reasons';

/** Tags that a screen on the wall may have room for, and reasons of each. */
const MOST_TAGS = 40;
const MOST_REASONS = 2;

/** For a wall screen: the tags that need somebody, the worst first. */
export function AttentionList(): JSX.Element {
  const rows = useUrgent();
  const { unknown } = useApp(selectHealth).counts;
  const list = useRef<HTMLUListElement>(null);
  const count = useFitting(list, rows.length);
  return (
    <div className="attention">
      <h3>{rows.length > 0 ? S.attention : noneText(unknown)}</h3>
      <ul ref={list} style={{ '--rows': rows.length } as CSSProperties}>
        {rows.slice(0, MOST_TAGS).map(({ tag, health: own }, index) => (
          <li key={tag.id} data-fits={index < count} data-tag-id={tag.id} data-health={own.verdict}>
            <strong>
              <bdi>{shown(tag.id, 16)}</bdi>
            </strong>
            <span className="attention-why">
              <Reasons health={own} most={MOST_REASONS} />
              <span className="attention-do">
                <strong>{todoTexts(own.reasons.slice(0, MOST_REASONS))}</strong>{' '}
                <small className="faint">
                  <Since tagId={tag.id} reason={worstReason(own)} />
                </small>
              </span>
            </span>
          </li>
        ))}
      </ul>
      {rows.length > count && (
        <p className="attention-more">{S.attentionMore(rows.length - count)}</p>
      )}
    </div>
  );
}

/** What to do about each of them, no word twice. */
const todoTexts = (reasons: readonly HealthReason[]): string =>
  [...new Set(reasons.map((reason) => todoText(reason)))].join(' · ');

const Since = (it: { tagId: string; reason: HealthReason | undefined }): string | null =>
  useSince(it.tagId, it.reason);

/** Of whom nothing is known, nobody knows that he needs nothing. */
const noneText = (unknown: number): string =>
  unknown > 0 ? S.attentionNoneKnown(unknown) : S.attentionNone;
