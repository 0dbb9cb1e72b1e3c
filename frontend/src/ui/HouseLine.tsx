import type { JSX } from 'react';

import { ageSeconds } from '../domain/age';
import { intervalText, ageText } from '../domain/format';
import { whenOf } from '../domain/twin';
import { isSilent } from '../domain/health';
import { useApp } from '../store/app';
import { selectHealth } from '../store/derived';
import { selectShown } from '../store/moment';
import { S } from '../strings';
import { useTicking } from '../widgets/useNow';

/** Of tags that report by themselves, all at once: no rhythm of anything. */
const LEAST_INTERVAL_S = 0.1;

/** What the house is doing, as the bridge tells it: how often it is scanned, when last, who is overdue. */
export function HouseLine(): JSX.Element | null {
  const health = useApp(selectHealth);
  const { patrol } = health;
  const { snapshot, ageing } = useApp(selectShown);
  const last = useTicking((now) => {
    if (!patrol?.last_scan || !snapshot) return null;
    const age = ageSeconds(whenOf(patrol.last_scan, snapshot), now, ageing);
    return age === null ? null : ageText(age);
  });
  if (!patrol || !snapshot || snapshot.tags.length === 0 || isSilent(health)) return null;
  const { interval_s: interval, last_scan: lastScan, overdue } = patrol;
  const rest = [
    lastScan === null ? S.houseNever : last === null ? null : S.houseLast(last),
    interval === null || interval < LEAST_INTERVAL_S ? null : S.houseRhythm(intervalText(interval)),
  ].filter((part) => part !== null);
  return (
    <p className="house-line" data-testid="house-line">
      {/* First: a narrow screen cuts the end. */}
      <span data-overdue={overdue > 0}>{S.houseOverdue(overdue)}</span>
      {rest.map((part, index) => (
        <span key={index}> · {part}</span>
      ))}
    </p>
  );
}
