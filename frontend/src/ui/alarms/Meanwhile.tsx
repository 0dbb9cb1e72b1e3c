import type { JSX } from 'react';

import { meanwhile } from '../../alarms/meanwhile';
import { textNow } from '../../alarms/speech';
import { shown } from '../../domain/text';
import { act, useApp } from '../../store/app';
import { useSelected } from '../../store/create';
import { S } from '../../strings';

/** Says that an alarm has come while another moment is shown, and leads to now. */
export function Meanwhile(): JSX.Element | null {
  const items = useSelected(meanwhile, (it) => it);
  const [worst] = items;
  const text = useApp((state) => (worst ? textNow(state, worst.alarm) : ''));
  if (!worst) return null;
  const { alarm } = worst;
  return (
    <div className="meanwhile" data-testid="meanwhile" data-health={worst.verdict}>
      <strong>{S.alarmsMeanwhile(text, items.length - 1)}</strong>
      <button
        type="button"
        onClick={() => {
          act({ type: 'look', view: { moment: null, selected: alarm.tag_id || null } });
        }}
      >
        {alarm.tag_id === '' ? S.backToLive : S.meanwhileShow(shown(alarm.tag_id, 24))}
      </button>
    </div>
  );
}
