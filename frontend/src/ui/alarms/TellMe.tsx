import { useId, type JSX } from 'react';

import { notifyState, wishNotify, type NotifyState } from '../../alarms/notify';
import { own } from '../../alarms/own';
import { soundState, wishSound, type SoundState } from '../../alarms/sound';
import { useSelected } from '../../store/create';
import { S } from '../../strings';
import { Check } from '../../widgets/controls';

/** What is to be said of it; asked for anew each time, for words come in several languages. */
const soundHint = (state: SoundState): string =>
  ({ ready: S.alarmSoundHint, waits: S.alarmSoundWaits, none: S.alarmSoundNone })[state];

const notifyHint = (state: NotifyState): string =>
  ({
    granted: S.alarmNotifyHint,
    asks: S.alarmNotifyHint,
    refused: S.alarmNotifyRefused,
    insecure: S.alarmNotifyInsecure,
    none: S.alarmNotifyNone,
  })[state];

/** How alarms come to who is not looking: nothing but what is wished. */
export function TellMe(): JSX.Element {
  const kept = useSelected(own, (it) => it);
  const sound = useSelected(soundState, (it) => it);
  const notify = useSelected(notifyState, (it) => it);
  return (
    <>
      <Way
        name="sound"
        label={S.alarmSound}
        isOn={kept.sound && sound !== 'none'}
        isPossible={sound !== 'none'}
        // Until it is wished, nothing has to wait.
        hint={soundHint(kept.sound || sound === 'none' ? sound : 'ready')}
        onChange={wishSound}
      />
      <Way
        name="notify"
        label={S.alarmNotify}
        isOn={kept.notify && notify === 'granted'}
        isPossible={notify === 'granted' || notify === 'asks'}
        hint={notifyHint(notify)}
        onChange={wishNotify}
      />
    </>
  );
}

function Way({
  name,
  label,
  isOn,
  isPossible,
  hint,
  onChange,
}: {
  name: string;
  label: string;
  isOn: boolean;
  isPossible: boolean;
  hint: string;
  onChange: (isWished: boolean) => Promise<void>;
}): JSX.Element {
  const id = useId();
  return (
    <div data-way={name}>
      <Check
        label={label}
        isOn={isOn}
        disabled={!isPossible}
        aria-describedby={id}
        onChange={(isWished) => void onChange(isWished)}
      />
      <p className="faint" id={id} role="status">
        {hint}
      </p>
    </div>
  );
}
