import type { JSX } from 'react';

import { ageText, intervalText, numberText } from '../domain/format';
import { isSilent, VERDICTS, type HouseHealth } from '../domain/health';
import { ageSeconds } from '../domain/time';
import { act, useApp } from '../store/app';
import { selectHealth } from '../store/derived';
import { selectClockFault, selectHasSnapshot, selectIsPaused, selectShown } from '../store/moment';
import { S } from '../strings';
import { useShownTime } from './Age';
import { DoNow, Overall, ShelvedCount } from './DoNow';
import { HealthMark, HealthShape } from './HealthMark';

/** The greenhouse's status, the reason for it, and the number of tags per status. */
export function HealthSummary({ kiosk }: { kiosk: boolean }): JSX.Element {
  const health = useApp(selectHealth);
  const filter = useApp((state) => state.view.health);
  const hasSnapshot = useApp(selectHasSnapshot);
  const isLast = useApp(selectClockFault) === null && isSilent(health);
  return (
    <section
      className="health"
      aria-label={S.healthHeading}
      data-testid="greenhouse-health"
      data-health={hasSnapshot ? health.verdict : undefined}
    >
      <div className="health-greenhouse">
        <h2 title={dayText(health)}>
          <span className="unseen">{S.healthHeading}: </span>
          {hasSnapshot && (
            <HealthMark verdict={health.verdict} text={isLast ? S.healthNotCurrent : undefined} />
          )}
        </h2>
        <ShelvedCount disabled={kiosk} />
        {kiosk && <Overall health={health} />}
      </div>
      {!kiosk && <DoNow />}
      <HouseLine />
      <ul className="health-counts">
        {VERDICTS.map((verdict) => (
          <li key={verdict}>
            <button
              type="button"
              aria-pressed={filter === verdict}
              disabled={kiosk}
              data-health={verdict}
              data-none={health.counts[verdict] === 0}
              onClick={() => act({ health: filter === verdict ? null : verdict, list: 'tags' })}
            >
              <HealthShape verdict={verdict} />
              <strong>
                {hasSnapshot ? numberText(health.counts[verdict], 0) : S.noValue}
              </strong>{' '}
              <span>{(health.counts[verdict] === 1 ? S.health : S.healthMany)[verdict]}</span>
              {!kiosk && <span className="unseen">{S.healthFilter}</span>}
            </button>
          </li>
        ))}
      </ul>
    </section>
  );
}

/** Whether the day or night ranges apply, and how that is known. */
function dayText({ day }: HouseHealth): string | undefined {
  return day ? S.healthDay(day.is_day, S.healthDaySource[day.source]) : undefined;
}

/** No scan for longer than both this, s, and one and a half rounds: the robot may have stopped. */
const LATE_S = 60;
const LATE_ROUNDS = 1.5;

/** The patrol as the bridge reports it: scan interval, last scan, and overdue tags. */
export function HouseLine(): JSX.Element | null {
  const health = useApp(selectHealth);
  const { patrol } = health;
  const { snapshot, moment } = useApp(selectShown);
  const isPaused = useApp(selectIsPaused);
  const interval = patrol?.interval_s ?? null;
  const ageAt = (at: number | null): number | null => ageSeconds(patrol?.last_scan ?? null, at);
  const last = useShownTime((at) => {
    const age = ageAt(at);
    return age === null ? null : ageText(age);
  });
  // In the past, or while the clock is paused, nobody can check on the robot.
  const isLate = useShownTime((at) =>
    interval !== null &&
    moment === null &&
    !isPaused &&
    (ageAt(at) ?? 0) > Math.max(LATE_S, LATE_ROUNDS * interval)
      ? 'late'
      : null,
  );
  if (!patrol || !snapshot || snapshot.tags.length === 0 || isSilent(health)) return null;
  const { last_scan: lastScan, overdue } = patrol;
  // Scanned, but at an unknown time, or the scans are no longer stored.
  const isKnown = snapshot.isWhole && snapshot.tags.every(({ readings }) => readings.size === 0);
  if (lastScan === null && !isKnown) return null;
  if (isLate && last !== null && interval !== null) {
    return (
      <p className="patrol-line" data-testid="patrol-line">
        <span data-overdue>{S.houseLate(last, intervalText(interval))}</span>
        {/* Otherwise the greenhouse's own reason says so. */}
        {health.reasons.length === 0 && <strong> · {S.todo.stopped}</strong>}
      </p>
    );
  }
  const rest = [
    lastScan === null ? S.houseNever : last === null ? null : S.houseLast(last),
    interval !== null ? S.scanInterval(intervalText(interval)) : null,
  ].filter((part) => part !== null);
  return (
    <p className="patrol-line" data-testid="patrol-line">
      {/* First: a narrow screen cuts the end. */}
      <span data-overdue={overdue > 0}>{S.houseOverdue(overdue)}</span>
      {rest.map((part, index) => (
        <span key={index}> · {part}</span>
      ))}
    </p>
  );
}
