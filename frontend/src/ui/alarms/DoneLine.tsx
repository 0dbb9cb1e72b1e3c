import type { JSX, ReactNode } from 'react';

import { done, undo } from '../../alarms/own';
import { useSelected } from '../../store/create';
import { S } from '../../strings';
import { once } from './once';

/** Above the list, in a place of its own: what is new in a list that is held, and what can be undone. */
export function DoneLine({
  added,
  onShow,
  children,
}: {
  /** Alarms that are new and not listed yet. */
  added: number;
  onShow: () => void;
  /** What can be done to the whole list. */
  children: ReactNode;
}): JSX.Element {
  const last = useSelected(done, (it) => it);
  return (
    <div className="alarm-line">
      {children}
      <div className="alarm-news" role="status" data-testid="alarm-line">
        {added > 0 && (
          <button type="button" data-line="new" title={S.alarmsNewHint} onClick={onShow}>
            {S.alarmsNew(added)}
          </button>
        )}
        {last && (
          <span data-line="done">
            {S.alarmDone[last.what](last.count)}{' '}
            <button type="button" onClick={once(undo)}>
              {S.alarmUndo}
            </button>
          </span>
        )}
      </div>
    </div>
  );
}
