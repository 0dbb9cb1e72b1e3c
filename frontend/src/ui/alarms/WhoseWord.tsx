import type { JSX } from 'react';

import type { Alarm, Session } from '../../contract/types';
import { clockText } from '../../domain/format';
import { secondsOf } from '../../domain/rostime';
import { useSelected } from '../../store/create';
import { S } from '../../strings';
import { person } from '../../store/signals';
import { P } from './people';

/** Below the list: whether what is done here is this browser's own, or everybody's. */
export function WhoseWord(): JSX.Element {
  const who = useSelected(person, (it) => it);
  return <p className="alarms-mine faint">{whoseWord(who)}</p>;
}

export function whoseWord(who: Session | null): string {
  if (!who?.name) return S.alarmsMine;
  if (who.can_write_notes) return P.shared(who.name);
  return (who.role === 'viewer' ? P.reads : P.elsewhere)(who.name);
}

/** Who acknowledged an alarm, and when, where a name is known. */
export function WhoAcknowledged({ alarm }: { alarm: Alarm }): JSX.Element | null {
  const { acknowledged_by: name, acknowledged_at: at } = alarm;
  if (!name || !at) return null;
  return (
    <span className="alarm-facts faint" data-fact="by">
      {P.acknowledged(name, clockText(secondsOf(at) * 1000))}
    </span>
  );
}
