import { Fragment, useMemo, type JSX } from 'react';

import { selectKnownSince } from '../alarms/latest';
import { sinceText } from '../alarms/words';
import { alarmOf, countText, isAwaited, oldestOf, type Item } from '../alarms/list';
import { alarmList } from '../alarms/watch';
import { now } from '../clock';
import type { HealthReason, Verdict } from '../contract/types';
import {
  airOf,
  byCause,
  type HouseHealth,
  isBack,
  isBad,
  isSilent,
  severity,
  todoText,
  VERDICTS,
} from '../domain/health';
import { numberText } from '../domain/format';
import { groupedBy } from '../domain/memo';
import { rowsOf } from '../domain/table';
import { shown } from '../domain/text';
import { act, type AppState, store, useApp } from '../store/app';
import { withList, withTag } from '../store/view';
import { useSelected } from '../store/create';
import { selectHealth } from '../store/derived';
import {
  rosNow,
  selectClockFault,
  selectHasSnapshot,
  selectShown,
  selectTags,
} from '../store/moment';
import { S } from '../strings';
import { HealthMark } from './HealthMark';
import { selectAreAlarmsKnown, useCauseText } from './Reasons';

/** Tags listed beside the map; the table has the rest. */
const MOST_TAGS = 2;
/** Most other tags with the same action that are named. */
const MOST_ALSO = 3;

/** One task at one tag. */
export interface Urgent {
  readonly tagId: string;
  /** All with this task, shelved ones excluded; the first is the most severe. */
  readonly reasons: readonly [HealthReason, ...HealthReason[]];
  /** Whether the alarms of all are acknowledged. */
  readonly isAcknowledged: boolean;
}

/**
 * What needs attention, most severe first; values back in range come last. Old readings and a first
 * failed scan do not count: they wait for the robot's next visit.
 */
export function useUrgent(): readonly Urgent[] {
  const tags = useApp(selectTags);
  const health = useApp(selectHealth);
  const isNow = useApp((state) => selectShown(state).moment === null);
  const isStarting = useApp(({ twin }) => twin.alarms?.source === 'starting');
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
          // A single failed scan is ordinary; while recorded data is being read, it may be one of many.
          const isSingle = isNow && !isStarting && !has(alarms.active, id, reason);
          if (reason.kind === 'scan_failed' && isSingle) return 0;
          const judged = { verdict: isBack(reason) ? 'healthy' : own, reasons: [reason] };
          return severity(judged, has(acknowledged, id, reason));
        };
        const open = reasons
          .filter((reason) => rank(reason) > 0 && !has(alarms.shelved, id, reason))
          .sort((a, b) => rank(b) - rank(a));
        const tasks = groupedBy(open, (reason) => airOf(reason) ?? todoText(reason));
        return [...tasks.values()].map((own) => ({
          tagId: id,
          reasons: own,
          isAcknowledged: own.every((reason) => has(acknowledged, id, reason)),
          rank: rank(own[0]),
        }));
      })
      .sort((a, b) => b.rank - a.rank);
  }, [tags, health, isNow, isStarting, alarms]);
}

/** Whether the tasks are those of now: what to do about past or last known values is no instruction. */
export const selectIsCurrent = (state: AppState): boolean =>
  selectShown(state).moment === null && !isSilent(selectHealth(state));

/**
 * Text: how long a task's alarms have been active, that they are acknowledged, or that there is none yet.
 * Null: unknown, a past moment is shown, or the banner already dates the data.
 */
export function useSince({ tagId, reasons, isAcknowledged }: Urgent): string | null {
  const isCurrent = useApp(selectIsCurrent);
  const active = useSelected(alarmList, (list) => list.active);
  const isKnown = useApp(selectAreAlarmsKnown);
  if (!isCurrent) return null;
  const oldest = oldestOf(reasons.flatMap((each) => alarmOf(active, tagId, each) ?? []));
  if (!oldest) return isKnown && isAwaited(reasons[0]) ? S.alarmNotYet : null;
  if (isAcknowledged) return S.healthAcknowledged;
  const state = store.get();
  return sinceText(oldest, rosNow(state, now()), selectKnownSince(state));
}

/**
 * What to do first: where, why, what, and since when; otherwise the greenhouse's status. A single line has
 * no room for the names of other tags with the same task: it counts them.
 */
export function DoNow({
  most = MOST_TAGS,
  id = 'health-driver',
}: {
  most?: number;
  /** Test id of the first line. */
  id?: string;
}): JSX.Element {
  const health = useApp(selectHealth);
  const urgent = useUrgent();
  const isCurrent = useApp(selectIsCurrent);
  const hasOwn = health.reasons.length > 0;
  // While the twin is silent, its last tasks stay listed, below the first one: to find out why.
  const isLast = isSilent(health);
  const isOfTags = urgent.length > 0 && (!hasOwn || isBad(health.verdict) || isLast);
  const count = hasOwn && most > 1 ? most - 1 : most;
  const hasAlso = most > 1;
  const lines = byTodo(urgent).slice(0, count);
  const rest = restOf(urgent, hasAlso ? lines.flat() : lines.map(([first]) => first));
  const own = isOfTags && count < most && (
    <li>
      <Overall health={health} id="health-own" />
    </li>
  );
  return (
    <ul className="do-now" aria-label={S.todoLabel} data-fixed={most > 1 && isCurrent}>
      {isLast && own}
      {isOfTags ? (
        lines.map(([task, ...others], index) => (
          <li key={index}>
            <button type="button" data-tag-id={task.tagId} onClick={() => act(withTag(task.tagId))}>
              <HealthMark verdict={task.reasons[0].verdict} word={false} />
              <Todo task={task} also={hasAlso ? others : []} id={index === 0 ? id : undefined} />
            </button>
            {index === lines.length - 1 && rest > 0 && (
              <button type="button" className="do-more" onClick={() => act(withList('tags'))}>
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
      {!isLast && own}
    </ul>
  );
}

/** How many tags have a task that is not shown; of those that are named already, only if no other has. */
export function restOf(all: readonly Urgent[], shownOnes: readonly Urgent[]): number {
  const named = new Set(shownOnes.map(({ tagId }) => tagId));
  const isShown = new Set(shownOnes);
  const hidden = new Set(all.filter((each) => !isShown.has(each)).map(({ tagId }) => tagId));
  return [...hidden].filter((id) => !named.has(id)).length || hidden.size;
}

/** Grouped by task, the most severe tag first; acknowledged ones form groups of their own. */
const byTodo = (urgent: readonly Urgent[]) => [
  ...groupedBy(urgent, (each) => `${todoText(each.reasons[0])}|${each.isAcknowledged}`).values(),
];

/** Other tags of the group, some by name; the verdict's mark precedes a name where it changes. */
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
      {S.further(more)}{' '}
    </span>
  );
}

function Todo({
  task,
  also,
  id,
}: {
  task: Urgent;
  /** Other tags with the same action. */
  also: readonly Urgent[];
  id: string | undefined;
}): JSX.Element {
  const { tagId } = task;
  const [reason] = task.reasons;
  // Other causes of the same task are on the card.
  const [cause = []] = byCause(task.reasons);
  const why = S.alarmWhat(S.card(shown(tagId, 24)), useCauseText(cause, true, tagId));
  const since = useSince(task);
  const isCurrent = useApp(selectIsCurrent);
  return (
    <>
      <span className="do-why" title={why} data-testid={id}>
        {why}
      </span>
      <span className="do-what">
        {isCurrent && <strong>{todoText(reason)}</strong>}{' '}
        {also.length > 0 && <Also of={also} than={reason.verdict} />}
        {since && <small>{since}</small>}
      </span>
    </>
  );
}

/** The greenhouse's status, where no single tag explains it. */
export function Overall({
  health,
  id = 'health-driver',
}: {
  health: HouseHealth;
  id?: string;
}): JSX.Element | null {
  const [own] = health.reasons;
  const reason = useCauseText(own ? [own] : []);
  // The alarm list is always live.
  const isNow = useApp((state) => selectShown(state).moment === null);
  const active = useSelected(alarmList, (list) => countText(list, 'active'));
  // What to do about a clock's fault is in the banner.
  const lacksTime = useApp(selectClockFault) !== null && isSilent(health);
  const text = lacksTime
    ? S.healthNoTime
    : own
      ? reason
      : overallText(health, isNow ? active : '0');
  const hasSnapshot = useApp(selectHasSnapshot);
  if (text === null || !hasSnapshot) return null;
  return (
    <p className="do-why" data-testid={id} title={text}>
      {text}
      {own && !lacksTime && <strong> {todoText(own)}</strong>}
    </p>
  );
}

/** Number of shelved alarms: they have no line of their own. */
export function ShelvedCount({ disabled = false }: { disabled?: boolean }): JSX.Element | null {
  // The alarm list is always live.
  const isNow = useApp((state) => selectShown(state).moment === null);
  const count = useSelected(alarmList, (list) => list.shelved.length);
  if (!isNow || count === 0) return null;
  return (
    <button
      type="button"
      className="shelved-count"
      disabled={disabled}
      onClick={() => act(withList('alarms'))}
    >
      {S.alarmGroups.shelved(String(count))}
    </button>
  );
}

/** Null: the tags' own lines say it. */
function overallText({ verdict, counts }: HouseHealth, alarms: string): string | null {
  if (isBad(verdict)) return null;
  if (verdict === 'healthy') return alarms !== '0' ? S.healthDespite(alarms) : S.healthAllWell;
  const { unknown } = counts;
  if (unknown === 0) return S.healthNothing;
  const all = VERDICTS.reduce((sum, each) => sum + counts[each], 0);
  return 2 * unknown > all ? S.healthMostUnknown : S.healthSomeUnknown(unknown);
}

/** The counts and the most urgent task, above the map on a phone, where the table is a tab away. */
export function HealthStrip(): JSX.Element {
  const { verdict, counts } = useApp(selectHealth);
  const hasSnapshot = useApp(selectHasSnapshot);
  return (
    <div className="health-strip" data-testid="health-strip" data-health={verdict}>
      {hasSnapshot && <HealthMark verdict={verdict} word={false} />}
      <ShelvedCount />
      <DoNow most={1} id="health-first" />
      <ul className="strip-counts">
        {VERDICTS.filter((each) => counts[each] > 0).map((each) => (
          <li key={each}>
            <HealthMark verdict={each} word={false} /> {numberText(counts[each], 0)}
          </li>
        ))}
      </ul>
    </div>
  );
}
