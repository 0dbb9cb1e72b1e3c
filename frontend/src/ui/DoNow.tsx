import { useMemo, type JSX } from 'react';

import { whenText } from '../alarms/words';
import { alarmOf } from '../alarms/list';
import { alarmList } from '../alarms/watch';
import { now } from '../clock';
import type { HealthReason } from '../contract/types';
import { clockText } from '../domain/format';
import { isBad, severity, VERDICTS, worstReason, type HouseHealth } from '../domain/health';
import { todoText } from '../domain/reasons';
import { secondsOf } from '../domain/rostime';
import { rowsOf, type Row } from '../domain/table';
import { shown } from '../domain/text';
import { act, store, useApp } from '../store/app';
import { useSelected } from '../store/create';
import { selectHealth } from '../store/derived';
import { rosNow, selectShown, selectTags } from '../store/moment';
import { S } from '../strings';
import { HealthMark } from './HealthMark';
import { useReasonText } from './Reasons';

/** Beside the map; the table has the rest. */
const MOST_TAGS = 2;

/**
 * Tags that need somebody, the worst first (`severity`).
 * What is only old needs the robot, which comes again.
 */
export function useUrgent(): readonly Row[] {
  const tags = useApp(selectTags);
  const health = useApp(selectHealth);
  const isNow = useApp((state) => selectShown(state).moment === null);
  const alarms = useSelected(alarmList, (it) => it);
  return useMemo(() => {
    const seen = isNow
      ? [...alarms.active.filter((it) => it.isAcknowledged), ...alarms.shelved]
      : [];
    return rowsOf(tags, health)
      .map((row) => ({ row, reason: worstReason(row.health) }))
      .filter(({ reason }) => reason && reason.kind !== 'old')
      .map(({ row, reason }) => {
        const isSeen = alarmOf(seen, row.tag.id, reason) !== undefined;
        return { row, rank: severity(row.health, isSeen) };
      })
      .sort((a, b) => b.rank - a.rank)
      .map(({ row }) => row);
  }, [tags, health, isNow, alarms]);
}

/**
 * Since when the alarm of a reason is active, what somebody has said of it, or that there is none
 * yet; null: nobody knows, or another moment is shown.
 */
export function useSince(tagId: string, reason: HealthReason | undefined): string | null {
  const isNow = useApp((state) => selectShown(state).moment === null);
  const found = useSelected(alarmList, ({ active, shelved }) =>
    alarmOf([...active, ...shelved], tagId, reason),
  );
  const isKnown = useApp(({ twin }) => twin.alarms !== null && twin.alarms.source !== 'starting');
  if (!isNow) return null;
  if (!found) return isKnown ? S.alarmNotYet : null;
  if (found.shelf) return S.alarmShelved(clockText(found.shelf.until), '', '');
  if (found.isAcknowledged) return S.healthAcknowledged;
  return S.alarmSince(whenText(secondsOf(found.alarm.raised_at), rosNow(store.get(), now())), null);
}

/** What has to be done first: where, why, what, and since when; else how the greenhouse is. */
export function DoNow({
  most = MOST_TAGS,
  id = 'health-driver',
}: {
  most?: number;
  /** Of its first line, for tests. */
  id?: string;
}): JSX.Element {
  const health = useApp(selectHealth);
  const { counts } = health;
  const urgent = useUrgent();
  const isOfTags = health.reasons.length === 0 && urgent.length > 0;
  return (
    <ul className="do-now" aria-label={S.todoLabel} data-most={most}>
      {isOfTags ? (
        urgent.slice(0, most).map(({ tag, health: own }, index) => (
          <li key={index}>
            <button
              type="button"
              data-tag-id={tag.id}
              onClick={() => {
                act({ type: 'select', tagId: tag.id });
              }}
            >
              <HealthMark verdict={own.verdict} word={false} />
              <Todo
                tagId={tag.id}
                reason={worstReason(own)}
                id={index === 0 ? id : undefined}
                more={index === most - 1 ? counts.critical - most : 0}
              />
            </button>
          </li>
        ))
      ) : (
        <li>
          <Overall health={health} id={id} />
        </li>
      )}
    </ul>
  );
}

function Todo({
  tagId,
  reason,
  id,
  more,
}: {
  tagId: string;
  reason: HealthReason | undefined;
  id: string | undefined;
  /** Critical tags that have no line here. */
  more: number;
}): JSX.Element {
  const why = S.healthDriver(shown(tagId, 24), useReasonText(reason ?? null, true));
  const since = useSince(tagId, reason);
  // What was to be done then is no order now.
  const isNow = useApp((state) => selectShown(state).moment === null);
  return (
    <>
      <span className="do-why" title={why} data-testid={id}>
        {why}
      </span>
      <span className="do-what">
        {reason && isNow && <strong>{todoText(reason)}</strong>} {since && <small>{since}</small>}
        {more > 0 && <small className="do-more">{S.healthMoreCritical(more)}</small>}
      </span>
    </>
  );
}

/** How the greenhouse is, where no tag makes it so. */
export function Overall({
  health,
  id = 'health-driver',
}: {
  health: HouseHealth;
  id?: string;
}): JSX.Element | null {
  const [own] = health.reasons;
  const reason = useReasonText(own ?? null);
  // Of now, as the list of alarms is.
  const isNow = useApp((state) => selectShown(state).moment === null);
  const alarms = useSelected(alarmList, ({ active, shelved }) => active.length + shelved.length);
  const text = own ? reason : overallText(health, isNow ? alarms : 0);
  if (text === null) return null;
  return (
    <p className="do-why" data-testid={id} title={text}>
      {text}
      {own && <strong> {todoText(own)}</strong>}
    </p>
  );
}

/** Null: its tags say it. */
function overallText({ verdict, counts }: HouseHealth, alarms: number): string | null {
  if (isBad(verdict)) return null;
  if (verdict === 'healthy') return alarms > 0 ? S.healthDespite(alarms) : S.healthAllWell;
  const { unknown } = counts;
  if (unknown === 0) return S.healthNothing;
  const all = VERDICTS.reduce((sum, each) => sum + counts[each], 0);
  return 2 * unknown > all ? S.healthMostUnknown : S.healthSomeUnknown(unknown);
}

/** Above the map of a phone, where the table is a tab away: the first of what has to be done. */
export function HealthStrip(): JSX.Element {
  const verdict = useApp((state) => selectHealth(state).verdict);
  return (
    <div className="health-strip" data-testid="health-strip" data-health={verdict}>
      <HealthMark verdict={verdict} word={false} />
      <DoNow most={1} id="health-first" />
    </div>
  );
}
