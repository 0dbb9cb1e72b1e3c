import type { JSX } from 'react';

import { whenText } from '../../alarms/words';
import type { Alarm, Session } from '../../contract/types';
import { secondsOf } from '../../domain/time';
import { store } from '../../store/app';
import { person, useSelected } from '../../store/create';
import { rosNow } from '../../store/moment';
import { S } from '../../strings';
import { useTicking } from '../../widgets/useNow';
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

/** Who acknowledged an alarm, and when; null: no name is known. */
export function useWhoAcknowledged(alarm: Alarm | null): string | null {
  const name = alarm?.acknowledged_by;
  const at = alarm?.acknowledged_at;
  const when = useTicking((tick) => (at ? whenText(secondsOf(at), rosNow(store.get(), tick)) : ''));
  return name && when !== '' ? P.acknowledged(name, when) : null;
}
