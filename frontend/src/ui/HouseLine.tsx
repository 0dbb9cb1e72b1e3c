import type { JSX } from 'react';

import { ageSeconds } from '../domain/age';
import { intervalText, ageText } from '../domain/format';
import { whenOf } from '../domain/twin';
import { useApp } from '../store/app';
import { selectHealth } from '../store/derived';
import { selectShown } from '../store/moment';
import { S } from '../strings';
import { useTicking } from '../widgets/useNow';

/** What the house is doing, as the bridge tells it: how often it is scanned, when last, who is overdue. */
export function HouseLine(): JSX.Element | null {
  const patrol = useApp((state) => selectHealth(state).patrol);
  const { snapshot, ageing } = useApp(selectShown);
  const last = useTicking((now) => {
    if (!patrol?.last_scan || !snapshot) return null;
    const age = ageSeconds(whenOf(patrol.last_scan, snapshot), now, ageing);
    return age === null ? null : ageText(age);
  });
  if (!patrol || !snapshot || snapshot.tags.length === 0) return null;
  const { interval_s: interval, last_scan: lastScan, overdue } = patrol;
  const parts = [
    ...(interval === null ? [] : [S.houseRhythm(intervalText(interval))]),
    lastScan === null ? S.houseNever : last === null ? null : S.houseLast(last),
  ].filter((part) => part !== null);
  return (
    <p className="house-line" data-testid="house-line">
      {parts.join(' · ')}
      {parts.length > 0 && ' · '}
      <span data-overdue={overdue > 0}>{S.houseOverdue(overdue)}</span>
    </p>
  );
}
