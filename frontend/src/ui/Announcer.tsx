import type { JSX } from 'react';

import { politeVoice, urgentVoice } from '../alarms/watch';
import { createVoice, useSelected, type Announcement, type Store } from '../store/create';

/** A voice each, so that none cuts off another; only a critical alarm may cut in. */
export function Announcer(): JSX.Element {
  return (
    <div className="unseen">
      <Voice of={chosenTag} testId="said-choice" />
      <Voice of={politeVoice} testId="said-alarms" />
      <Voice of={urgentVoice} testId="said-critical" role="alert" />
    </div>
  );
}

function Voice({
  of,
  testId,
  role = 'status',
}: {
  of: Store<Announcement>;
  testId: string;
  role?: 'status' | 'alert';
}): JSX.Element {
  const { text, key } = useSelected(of);
  return (
    <div role={role} data-testid={testId}>
      {/* Anew each time, or the same words twice would be no change to tell of. */}
      <p key={key}>{text}</p>
    </div>
  );
}

/** The tag that a key has chosen. */
export const chosenTag = createVoice();
