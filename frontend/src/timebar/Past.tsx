import type { JSX } from 'react';

import { DAY_S } from '../domain/difference';
import { ageText, intervalText } from '../domain/format';
import { ageSeconds, rosText } from '../domain/time';
import { store, useApp } from '../store/app';
import {
  backToLive,
  latestTime,
  ownTime,
  selectDayS,
  selectIsRecorded,
  selectOrigin,
  selectShown,
} from '../store/moment';
import { S } from '../strings';
import { useTicking } from '../widgets/useNow';

/** In the header while a past moment is shown: the moment, and a button back to live. */
export function PastHeader(): JSX.Element | null {
  const moment = useApp((state) => selectShown(state).moment);
  const isLooking = useApp((state) => state.view.moment !== null);
  // Without the twin's time, it is unknown how long ago.
  const ago = useTicking((now) => {
    const since = ageSeconds(moment, latestTime(store.get(), now));
    return since === null ? null : ageText(since);
  });
  const origin = useApp(selectOrigin);
  if (moment === null || !isLooking) return null;
  return (
    <div className="past-header" data-testid="past-header">
      <span className="past-word">{S.past}</span>
      {/* Replaces the header's origin note, which a phone has no room for. */}
      {origin !== null && (
        <span className="past-origin" aria-hidden="true">
          {S.origin[origin]}
        </span>
      )}
      <strong>{rosText(moment)}</strong>
      {/* A running count must not be read out every second. */}
      {ago !== null && (
        <span className="past-ago" aria-hidden="true">
          {S.agoSuffix(ago)}
        </span>
      )}
      <LiveButton />
    </div>
  );
}

export function LiveButton(): JSX.Element {
  const words = useApp(selectIsRecorded) ? S.backToRecording : S.backToLive;
  return (
    <button type="button" className="back-to-live" title={`${words} (L)`} onClick={backToLive}>
      {words}
    </button>
  );
}

function useOwnTime(): string | null {
  return useTicking((now) => {
    const at = ownTime(store.get(), now);
    return at === null ? null : rosText(at);
  });
}

/** In the header: says that the data is simulated or recorded; for a recording, with its time. */
export function OriginNote(): JSX.Element | null {
  const origin = useApp(selectOrigin);
  const isPast = useApp((state) => selectShown(state).moment !== null);
  const time = useOwnTime();
  // Shortened in a demo.
  const dayS = useApp(selectDayS);
  if (origin === null) return null;
  return (
    <div className="origin" data-testid="origin" data-origin={origin} title={S.originHint[origin]}>
      <span className="origin-word">
        {S.origin[origin]}
        {dayS < DAY_S && <span className="origin-day"> · {S.originDay(intervalText(dayS))}</span>}
      </span>
      <span className="unseen">{S.originHint[origin]}</span>
      {/* A running count must not be read out every second. */}
      {origin === 'recorded' && time !== null && !isPast && (
        <strong aria-hidden="true">{time}</strong>
      )}
    </div>
  );
}

/** Frame around the map while not live; decorative, because the header says it in words. */
export function PastFrame(): JSX.Element | null {
  const moment = useApp((state) => selectShown(state).moment);
  const isRecorded = useApp(selectIsRecorded);
  const time = useOwnTime();
  if (moment === null && isRecorded) {
    return (
      <div className="past-frame recorded" data-testid="recorded-frame" aria-hidden="true">
        <span>{time === null ? S.origin.recorded : `${S.origin.recorded}: ${time}`}</span>
      </div>
    );
  }
  if (moment === null) return null;
  return <div className="past-frame" data-testid="past-frame" aria-hidden="true" />;
}
