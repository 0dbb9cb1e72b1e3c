import { useEffect, type JSX } from 'react';

import { useSelected, type Store } from '../store/create';
import { chosenTag, criticalTags, startAnnouncing, type Announcement } from './announce';

/** Two voices, so that neither cuts off the other. */
export function Announcer(): JSX.Element {
  useEffect(startAnnouncing, []);
  return (
    <div className="unseen">
      <Voice of={chosenTag} testId="said-choice" />
      <Voice of={criticalTags} testId="said-critical" />
    </div>
  );
}

function Voice({ of, testId }: { of: Store<Announcement, string>; testId: string }): JSX.Element {
  const { text, key } = useSelected(of, (said) => said);
  return (
    <div role="status" data-testid={testId}>
      {/* Anew each time, or the same words twice would be no change to tell of. */}
      <p key={key}>{text}</p>
    </div>
  );
}
