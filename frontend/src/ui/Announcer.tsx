import type { JSX } from 'react';

import { politeVoice, urgentVoice } from '../alarms/watch';
import { createVoice, useSelected, type Announcement, type Store } from '../store/create';

/** One live region per voice, so none cuts off another; only a critical alarm may interrupt. */
export function Announcer(): JSX.Element {
  return (
    <div className="unseen">
      <Voice of={chosenTag} testId="announced-choice" />
      <Voice of={politeVoice} testId="announced-alarms" />
      <Voice of={urgentVoice} testId="announced-critical" role="alert" />
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
      {/* A new element each time: repeating the same text would not be announced. */}
      <p key={key}>{text}</p>
    </div>
  );
}

/** The tag selected by keyboard. */
export const chosenTag = createVoice();
