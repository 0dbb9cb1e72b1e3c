import type { JSX } from 'react';

import { useApp } from '../store/app';
import { selectShown } from '../store/moment';
import { selectIsRecorded } from '../store/origin';
import { S } from '../strings';
import { useOwnTime } from './OriginNote';

/** Around the map, for eyes: the header tells everybody. */
export function PastFrame(): JSX.Element | null {
  const moment = useApp((state) => selectShown(state).moment);
  const isRecorded = useApp(selectIsRecorded);
  const time = useOwnTime();
  if (moment === null && isRecorded) {
    return (
      <div className="past-frame recorded" data-testid="recorded-frame" aria-hidden="true">
        <span>
          {time === null ? (
            S.origin.recorded
          ) : (
            <>
              <span className="past-word-short">{S.origin.recorded}: </span>
              {time}
            </>
          )}
        </span>
      </div>
    );
  }
  if (moment === null) return null;
  return <div className="past-frame" data-testid="past-frame" aria-hidden="true" />;
}
