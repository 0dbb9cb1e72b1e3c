import type { JSX } from 'react';

import { useApp } from '../store/app';
import { selectIsRecorded } from '../store/origin';
import { S } from '../strings';
import { backToLive } from './backToLive';

export function LiveButton(): JSX.Element {
  const words = useApp(selectIsRecorded) ? S.backToRecording : S.backToLive;
  return (
    <button type="button" className="back-to-live" title={`${words} (L)`} onClick={backToLive}>
      {words}
    </button>
  );
}
