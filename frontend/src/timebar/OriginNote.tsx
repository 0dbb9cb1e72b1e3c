import type { JSX } from 'react';

import { DAY_S } from '../domain/difference';
import { intervalText } from '../domain/format';
import { rosText } from '../domain/rostime';
import { store, useApp } from '../store/app';
import { selectShown } from '../store/moment';
import { ownTime, selectDayS, selectOrigin } from '../store/origin';
import { S } from '../strings';
import { useTicking } from '../widgets/useNow';

/** The newest moment of a recording or a simulation, as a text that goes on. */
export function useOwnTime(): string | null {
  return useTicking((now) => {
    const at = ownTime(store.get(), now);
    return at === null ? null : rosText(at);
  });
}

/** In the header: that what is shown is no robot's, or not of now; and of a recording, of when. */
export function OriginNote(): JSX.Element | null {
  const origin = useApp(selectOrigin);
  const isPast = useApp((state) => selectShown(state).moment !== null);
  const time = useOwnTime();
  // In a demo a short one.
  const dayS = useApp(selectDayS);
  if (origin === null) return null;
  return (
    <div className="origin" data-testid="origin" data-origin={origin} title={S.originHint[origin]}>
      <span className="origin-word">
        {S.origin[origin]}
        {dayS < DAY_S && <span className="origin-day"> · {S.originDay(intervalText(dayS))}</span>}
      </span>
      <span className="unseen">{S.originHint[origin]}</span>
      {/* What counts on by itself is not read out each second. */}
      {origin === 'recorded' && time !== null && !isPast && (
        <strong aria-hidden="true">{time}</strong>
      )}
    </div>
  );
}
