import type { JSX } from 'react';

import { alarmList } from '../alarms/watch';
import { VERDICTS, type HouseHealth } from '../domain/health';
import { shown } from '../domain/text';
import { act, useApp } from '../store/app';
import { useSelected } from '../store/create';
import { selectHealth } from '../store/derived';
import { selectShown } from '../store/moment';
import { S } from '../strings';
import { HealthMark, HealthShape } from './HealthMark';
import { HouseLine } from './HouseLine';
import { useReasonText } from './Reasons';

/** What makes the greenhouse what it is, in words. */
function useDriver(health: HouseHealth): string {
  const reason = useReasonText(health.reasons[0] ?? health.worst?.health.reasons[0] ?? null);
  // Of now, as the list of alarms is.
  const isNow = useApp((state) => selectShown(state).moment === null);
  const alarms = useSelected(alarmList, ({ active, shelved }) => active.length + shelved.length);
  return driverText(health, reason, isNow ? alarms : 0);
}

/** Above the map of a phone, where the table is a tab away: the worst, and the way to the list. */
export function HealthStrip(): JSX.Element {
  const health = useApp(selectHealth);
  return (
    <button
      type="button"
      className="health-strip"
      data-testid="health-strip"
      data-health={health.verdict}
      onClick={() => {
        act({ type: 'list', list: 'tags' });
      }}
    >
      <HealthMark verdict={health.verdict} word={false} />
      <span>{useDriver(health)}</span>
    </button>
  );
}

/** How the house is, why, and how many tags are how. */
export function HealthSummary({ kiosk }: { kiosk: boolean }): JSX.Element {
  const health = useApp(selectHealth);
  const filter = useApp((state) => state.view.health);
  const { worst } = health;
  const driver = useDriver(health);
  return (
    <section
      className="health"
      aria-label={S.healthHeading}
      data-testid="house-health"
      data-health={health.verdict}
    >
      <div className="health-house">
        <h2 title={dayText(health)}>
          <span className="unseen">{S.healthHeading}: </span>
          <HealthMark verdict={health.verdict} />
        </h2>
        {worst && !kiosk ? (
          <button
            type="button"
            className="health-driver"
            data-testid="health-driver"
            data-tag-id={worst.tagId}
            title={driver}
            onClick={() => {
              act({ type: 'select', tagId: worst.tagId });
            }}
          >
            {driver}
          </button>
        ) : (
          <p className="health-driver" data-testid="health-driver" title={driver}>
            {driver}
          </p>
        )}
      </div>
      <HouseLine />
      <ul className="health-counts">
        {VERDICTS.map((verdict) => (
          <li key={verdict}>
            <button
              type="button"
              aria-pressed={filter === verdict}
              disabled={kiosk}
              data-health={verdict}
              onClick={() => {
                act({ type: 'health', verdict: filter === verdict ? null : verdict });
              }}
            >
              <HealthShape verdict={verdict} />
              <strong>{health.counts[verdict]}</strong> <span>{S.health[verdict]}</span>
              {!kiosk && <span className="unseen">{S.healthFilter}</span>}
            </button>
          </li>
        ))}
      </ul>
    </section>
  );
}

/** What makes the house what it is; `reason` is the house's own, or that of its worst tag. */
function driverText(
  { verdict, worst, counts }: HouseHealth,
  reason: string,
  alarms: number,
): string {
  if (worst) return S.healthDriver(shown(worst.tagId, 24), reason);
  if (reason !== '') return reason;
  if (verdict === 'healthy') return alarms > 0 ? S.healthDespite(alarms) : S.healthAllWell;
  const { unknown } = counts;
  if (unknown === 0) return S.healthNothing;
  const all = VERDICTS.reduce((sum, each) => sum + counts[each], 0);
  return 2 * unknown > all ? S.healthMostUnknown : S.healthSomeUnknown(unknown);
}

/** Whose ranges hold, and how that is known. */
function dayText({ day }: HouseHealth): string | undefined {
  return day ? S.healthDay(day.is_day, S.healthDaySource[day.source]) : undefined;
}
