import type { JSX } from 'react';

import { timeOfDay } from '../clock';
import { addressOfPage, CYCLE_LIMITS, type CycleWish, nextSensor } from '../store/cycle';
import { clockText, shortAgeText } from '../domain/format';
import { shown } from '../domain/text';
import { useApp } from '../store/app';
import { useSelected } from '../store/create';
import { selectSensor } from '../store/derived';
import { S } from '../strings';
import { useTicking } from '../widgets/useNow';

/** Longest part of a wish that is told back. */
const LONGEST_WISH = 12;

/** In the header of a wall screen: the time, which sensor is shown until when, and how to leave. */
export function KioskNote({ wish }: { wish: CycleWish }): JSX.Element {
  const next = useSelected(nextSensor, (coming) => coming);
  const sensor = useApp(selectSensor);
  const left = useTicking((now) =>
    next ? shortAgeText(Math.max(0, Math.ceil((next.at - now) / 1000))) : null,
  );
  const time = useTicking(() => clockText(timeOfDay()).slice(0, -3));
  return (
    <div className="kiosk-note" data-testid="kiosk-note">
      {wish.refused !== null && (
        <span role="status">
          {S.cycleRefused(shown(wish.refused, LONGEST_WISH), CYCLE_LIMITS.least, CYCLE_LIMITS.most)}
        </span>
      )}
      {next && left !== null && (
        <span className="kiosk-round" data-testid="cycle">
          <strong>{shown(sensor.label, 24)}</strong>{' '}
          <span>{S.cycleNext(shown(next.sensor.label, 24), left)}</span>
        </span>
      )}
      <button type="button" className="text-button" onClick={leaveKiosk}>
        {S.kioskLeave} <kbd>Esc</kbd>
      </button>
      <time className="kiosk-clock">{time}</time>
    </div>
  );
}

/** To the same view, to be operated; Back leads to the wall screen again. */
export function leaveKiosk(): void {
  const { search, hash } = window.location;
  window.location.assign(addressOfPage(search, hash));
}

/** The key that the note names. */
export function startLeaving(): () => void {
  const onKeyDown = (event: KeyboardEvent): void => {
    if (event.key === 'Escape' && !event.defaultPrevented) leaveKiosk();
  };
  document.addEventListener('keydown', onKeyDown);
  return () => {
    document.removeEventListener('keydown', onKeyDown);
  };
}
