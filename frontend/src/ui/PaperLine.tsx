import type { JSX } from 'react';

import { epochOf, timeOfDay } from '../clock';
import { dateText, rosText } from '../domain/time';
import { useApp } from '../store/app';
import { useSelected } from '../store/create';
import { selectHasOwnTime, selectOrigin, selectShown, selectSnapshot } from '../store/moment';
import { printing } from '../store/theme';
import { S } from '../strings';

/** Printed only: as of when; the legend says what is shown. "Live" and "5 s" mean nothing an hour later. */
export function PaperLine(): JSX.Element | null {
  const printedAt = useSelected(printing) ?? timeOfDay();
  const takenAt = useApp((state) => selectSnapshot(state)?.takenAt);
  const moment = useApp((state) => selectShown(state).moment);
  const origin = useApp(selectOrigin);
  // A recording or simulation has its own time: print that, not when the data arrived.
  const ownAt = useApp((state) =>
    selectHasOwnTime(state) ? (selectSnapshot(state)?.at ?? null) : null,
  );
  if (takenAt === undefined) return null;
  const then = moment ?? ownAt;
  // Data may still arrive while the print dialog is open.
  const printed = then === null && printedAt < epochOf(takenAt) ? epochOf(takenAt) : printedAt;
  const time = then === null ? dateText(epochOf(takenAt)) : rosText(then);
  const taken = origin === null ? time : `${time} (${S.origin[origin]})`;
  return (
    <p className="paper-line" data-testid="paper-line">
      <strong>{S.paper(taken, dateText(printed))}</strong>
    </p>
  );
}
