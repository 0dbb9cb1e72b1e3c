import { Fragment, useMemo, type JSX } from 'react';

import { whenText } from '../alarms/words';
import { alarmOf, isAwaited, type Item } from '../alarms/list';
import { alarmList } from '../alarms/watch';
import { now } from '../clock';
import type { HealthReason, Verdict } from '../contract/types';
import { type HouseHealth, isBad, isSilent, severity, todoText, VERDICTS } from '../domain/health';
import { secondsOf } from '../domain/time';
import { rowsOf } from '../domain/table';
import { shown } from '../domain/text';
import { act, store, useApp } from '../store/app';
import { withList, withTag } from '../store/view';
import { useSelected } from '../store/create';
import { selectHealth } from '../store/derived';
import { rosNow, selectIsHere, selectShown, selectTags } from '../store/moment';
import { S } from '../strings';
import { HealthMark } from './HealthMark';
import { selectAreAlarmsKnown, useReasonText } from './Reasons';

/** Beside the map; the table has the rest. */
const MOST_TAGS = 2;
/** Of other tags that need the same, so many by name. */
const MOST_ALSO = 3;

/** A tag that needs somebody. */
export interface Urgent {
  readonly tagId: string;
  /** Without what is shelved; the first is what it needs somebody for. */
  readonly reasons: readonly [HealthReason, ...HealthReason[]];
  /** Somebody sees to that one. */
  readonly isAcknowledged: boolean;
}

/**
 * Tags that need somebody, and what of each, in the order of `severity`; what is back in its range
 * comes last. What is only old needs the robot, which comes again.
 */
export function useUrgent(): readonly Urgent[] {
  const tags = useApp(selectTags);
  const health = useApp(selectHealth);
  const isNow = useApp((state) => selectShown(state).moment === null);
  const alarms = useSelected(alarmList);
  return useMemo(() => {
    const acknowledged = alarms.active.filter((it) => it.isAcknowledged);
    const has = (items: readonly Item[], tagId: string, reason: HealthReason): boolean =>
      isNow && alarmOf(items, tagId, reason) !== undefined;
    return rowsOf(tags, health)
      .flatMap(({ tag: { id }, health: { verdict, reasons } }) => {
        const rank = (reason: HealthReason): number => {
          const own = reason.verdict;
          if (reason.kind === 'old' || !(isBad(own) || own === verdict)) return 0;
          const isBack = todoText(reason) === '';
          const judged = { verdict: isBack ? 'healthy' : own, reasons: [reason] };
          return severity(judged, has(acknowledged, id, reason));
        };
        const [first, ...rest] = reasons
          .filter((reason) => !has(alarms.shelved, id, reason))
          .sort((a, b) => rank(b) - rank(a));
        if (!first || rank(first) === 0) return [];
        const isAcknowledged = has(acknowledged, id, first);
        return [
          { tagId: id, reasons: [first, ...rest] as const, isAcknowledged, rank: rank(first) },
        ];
      })
      .sort((a, b) => b.rank - a.rank);
  }, [tags, health, isNow, alarms]);
}

/**
 * Since when the alarm of a reason is active, that somebody has acknowledged it, or that there is none
 * yet. Null: nobody knows, another moment is shown, or the banner says of when all this is.
 */
export function useSince(tagId: string, reason: HealthReason): string | null {
  const isNow = useApp((state) => selectShown(state).moment === null);
  const found = useSelected(alarmList, ({ active }) => alarmOf(active, tagId, reason));
  const isKnown = useApp(selectAreAlarmsKnown);
  const isLast = useApp((state) => isSilent(selectHealth(state)));
  if (!isNow || isLast) return null;
  if (!found) return isKnown && isAwaited(reason) ? S.alarmNotYet : null;
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
  const urgent = useUrgent();
  const isNow = useApp((state) => selectShown(state).moment === null);
  const hasOwn = health.reasons.length > 0;
  // Of a twin that is not heard, what had to be done stays.
  const isOfTags = urgent.length > 0 && (!hasOwn || isBad(health.verdict) || isSilent(health));
  const count = hasOwn && most > 1 ? most - 1 : most;
  const lines = (isNow ? byTodo(urgent) : urgent.map((each) => [each] as const)).slice(0, count);
  const rest = urgent.length - lines.flat().length;
  return (
    <ul className="do-now" aria-label={S.todoLabel} data-most={most}>
      {isOfTags ? (
        lines.map(([{ tagId, reasons }, ...others], index) => (
          <li key={index}>
            <button
              type="button"
              data-tag-id={tagId}
              onClick={() => {
                act(withTag(tagId));
              }}
            >
              <HealthMark verdict={reasons[0].verdict} word={false} />
              <Todo
                tagId={tagId}
                reason={reasons[0]}
                also={others}
                id={index === 0 ? id : undefined}
              />
            </button>
            {index === lines.length - 1 && rest > 0 && (
              <button
                type="button"
                className="do-more"
                onClick={() => {
                  act(withList('tags'));
                }}
              >
                {S.attentionMore(rest)}
              </button>
            )}
          </li>
        ))
      ) : (
        <li>
          <Overall health={health} id={id} />
        </li>
      )}
      {isOfTags && count < most && (
        <li>
          <Overall health={health} id="health-own" />
        </li>
      )}
    </ul>
  );
}

/** Of tags that need the same the first stands for all, but not of those that somebody sees to. */
function byTodo(urgent: readonly Urgent[]): readonly (readonly [Urgent, ...Urgent[]])[] {
  const found = new Map<string, [Urgent, ...Urgent[]]>();
  for (const each of urgent) {
    const todo = todoText(each.reasons[0]);
    const key = todo === '' ? each.tagId : `${todo}|${String(each.isAcknowledged)}`;
    const line = found.get(key);
    if (line) line.push(each);
    else found.set(key, [each]);
  }
  return [...found.values()];
}

/** Some by name; those that are less bad come behind the sign of it. */
function Also({ of, than }: { of: readonly Urgent[]; than: Verdict }): JSX.Element {
  const more = of.length - MOST_ALSO;
  const verdicts = [than, ...of.map(({ reasons: [{ verdict }] }) => verdict)];
  return (
    <span>
      {S.todoAlso(of.length)}{' '}
      {of.slice(0, MOST_ALSO).map(({ tagId, reasons: [{ verdict }] }, index) => (
        <Fragment key={tagId}>
          {index > 0 && ', '}
          {verdict !== verdicts[index] && (
            <>
              <HealthMark verdict={verdict} word={false} />{' '}
            </>
          )}
          {shown(tagId, 16)}
        </Fragment>
      ))}
      {more > 0 && ` + ${more}`}{' '}
    </span>
  );
}

function Todo({
  tagId,
  reason,
  also,
  id,
}: {
  tagId: string;
  reason: HealthReason;
  /** Other tags that need the same. */
  also: readonly Urgent[];
  id: string | undefined;
}): JSX.Element {
  const why = S.healthDriver(shown(tagId, 24), useReasonText(reason, true));
  const since = useSince(tagId, reason);
  // What was to be done then is no order now.
  const isNow = useApp((state) => selectShown(state).moment === null);
  return (
    <>
      <span className="do-why" title={why} data-testid={id}>
        {why}
      </span>
      <span className="do-what">
        {isNow && <strong>{todoText(reason)}</strong>}{' '}
        {also.length > 0 && <Also of={also} than={reason.verdict} />}
        {since && <small>{since}</small>}
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
  const active = useSelected(alarmList, (list) => list.active.length);
  const shelved = useSelected(alarmList, (list) => list.shelved.length);
  const text = own ? reason : overallText(health, isNow ? active + shelved : 0);
  const isHere = useApp(selectIsHere);
  if (text === null || !isHere) return null;
  return (
    <p className="do-why" data-testid={id} title={text}>
      {text}
      {own && <strong> {todoText(own)}</strong>}
    </p>
  );
}

/** How much is shelved, where something is wrong: it has no line of its own. */
export function ShelvedCount({ disabled = false }: { disabled?: boolean }): JSX.Element | null {
  const isWrong = useApp((state) => isBad(selectHealth(state).verdict));
  // Of now, as the list of alarms is.
  const isNow = useApp((state) => selectShown(state).moment === null);
  const count = useSelected(alarmList, (list) => list.shelved.length);
  if (!isWrong || !isNow || count === 0) return null;
  return (
    <button
      type="button"
      className="shelved-count"
      disabled={disabled}
      onClick={() => {
        act(withList('alarms'));
      }}
    >
      {S.alarmGroups.shelved(String(count))}
    </button>
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
  const isHere = useApp(selectIsHere);
  return (
    <div className="health-strip" data-testid="health-strip" data-health={verdict}>
      {isHere && <HealthMark verdict={verdict} word={false} />}
      <ShelvedCount />
      <DoNow most={1} id="health-first" />
    </div>
  );
}
