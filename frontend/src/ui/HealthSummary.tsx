import type { JSX } from 'react';

import { isSilent, VERDICTS, type HouseHealth } from '../domain/health';
import { act, useApp } from '../store/app';
import { selectHealth } from '../store/derived';
import { selectIsHere } from '../store/moment';
import { S } from '../strings';
import { DoNow, Overall, ShelvedCount } from './DoNow';
import { HealthMark, HealthShape } from './HealthMark';
import { HouseLine } from './HouseLine';

/** How the house is, why, and how many tags are how. */
export function HealthSummary({ kiosk }: { kiosk: boolean }): JSX.Element {
  const health = useApp(selectHealth);
  const filter = useApp((state) => state.view.health);
  const isHere = useApp(selectIsHere);
  return (
    <section
      className="health"
      aria-label={S.healthHeading}
      data-testid="house-health"
      data-health={isHere ? health.verdict : undefined}
    >
      <div className="health-house">
        <h2 title={dayText(health)}>
          <span className="unseen">{S.healthHeading}: </span>
          {isHere && (
            <HealthMark
              verdict={health.verdict}
              text={isSilent(health) ? S.healthNotCurrent : undefined}
            />
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
              onClick={() => {
                act({ type: 'health', verdict: filter === verdict ? null : verdict });
              }}
            >
              <HealthShape verdict={verdict} />
              <strong>{isHere ? health.counts[verdict] : S.noValue}</strong>{' '}
              <span>{(health.counts[verdict] === 1 ? S.health : S.healthMany)[verdict]}</span>
              {!kiosk && <span className="unseen">{S.healthFilter}</span>}
            </button>
          </li>
        ))}
      </ul>
    </section>
  );
}

/** Whose ranges hold, and how that is known. */
function dayText({ day }: HouseHealth): string | undefined {
  return day ? S.healthDay(day.is_day, S.healthDaySource[day.source]) : undefined;
}
