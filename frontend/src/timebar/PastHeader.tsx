import type { JSX } from 'react';

import { ageText } from '../domain/format';
import { rosText } from '../domain/rostime';
import { store, useApp } from '../store/app';
import { rosNow, selectHasTime, selectShown } from '../store/moment';
import { selectIsRecorded, selectOrigin } from '../store/origin';
import { S } from '../strings';
import { useTicking } from '../widgets/useNow';
import { backToLive } from './span';

/** In the header while the page shows another moment: which one, and the way back. */
export function PastHeader(): JSX.Element | null {
  const moment = useApp((state) => selectShown(state).moment);
  const isLooking = useApp((state) => state.view.moment !== null);
  // Of a twin that has no time nobody knows how long ago.
  const ago = useTicking((now) => {
    const nowS = rosNow(store.get(), now);
    return nowS === null || moment === null ? null : ageText(Math.max(0, nowS - moment));
  });
  const origin = useApp(selectOrigin);
  const hasTime = useApp(selectHasTime);
  if (moment === null || !isLooking) return null;
  return (
    <div className="past-header" data-testid="past-header">
      <span className="past-word">{S.past}</span>
      {/* In place of the header's own mark, where a phone has no room for it. */}
      {origin !== null && (
        <span className="past-origin" aria-hidden="true">
          {S.origin[origin]}
        </span>
      )}
      <strong>{rosText(moment)}</strong>
      {/* What counts on by itself is not read out each second. */}
      {ago !== null && hasTime && (
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
