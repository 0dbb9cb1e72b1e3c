import { useMemo, useRef, type JSX } from 'react';

import { rowsOf, sortRows } from '../domain/table';
import { shown } from '../domain/text';
import { useApp } from '../store/app';
import { selectHealth } from '../store/derived';
import { selectTags } from '../store/moment';
import { S } from '../strings';
import { Age } from './Age';
import { useFitting } from './fitting';
import { Reasons } from './Reasons';

/** Tags that a screen on the wall may have room for, and reasons of each. */
const MOST_TAGS = 40;
const MOST_REASONS = 2;

/** For a wall screen: the tags that need somebody, the worst first. */
export function AttentionList(): JSX.Element {
  const tags = useApp(selectTags);
  const health = useApp(selectHealth);
  const rows = useMemo(
    () =>
      sortRows(rowsOf(tags, health), { column: 'health', descending: true }).filter(
        ({ health: { verdict } }) => verdict === 'critical' || verdict === 'stressed',
      ),
    [tags, health],
  );
  const list = useRef<HTMLUListElement>(null);
  const count = useFitting(list, rows.length);
  return (
    <div className="attention">
      <h3>{rows.length > 0 ? S.attention : noneText(health.counts.unknown)}</h3>
      <ul ref={list}>
        {rows.slice(0, MOST_TAGS).map(({ tag, health: own }, index) => (
          <li key={tag.id} data-fits={index < count} data-tag-id={tag.id} data-health={own.verdict}>
            <strong>
              <bdi>{shown(tag.id, 16)}</bdi>
            </strong>
            <span className="attention-why">
              <Reasons health={own} most={MOST_REASONS} />
            </span>
            <span className="faint">
              <Age when={tag.scannedAt} />
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

/** Of whom nothing is known, nobody knows that he needs nothing. */
const noneText = (unknown: number): string =>
  unknown > 0 ? S.attentionNoneKnown(unknown) : S.attentionNone;
