/** The words for causes of alarms on a card, and for what to do about each. */
import { useEffect } from 'react';

import { causeWords } from '../alarms/arrange';
import { inOnePiece, whereText } from '../alarms/words';
import { todoText } from '../domain/health';
import { S } from '../strings';
import type { Cause } from './sites';
import { useSensors } from './useAnswer';

export type CauseText = (cause: Cause) => readonly [cause: string, todo: string];

/** Renders nothing; hands out the words once the names of sensors are known, and when they change. */
export default function Causes({ onWords }: { onWords: (text: CauseText) => void }): null {
  const sensors = useSensors();
  useEffect(() => {
    onWords(({ count, air, ...worst }) => {
      const where = count > 1 ? S.shownOf(count, count) : whereText(worst);
      const cause = air ? S.airCause[air] : causeWords(worst, sensors);
      const text = worst.tag_id === '' ? cause : `${cause} · ${inOnePiece(where)}`;
      return [text, todoText(worst.reason)];
    });
  }, [sensors, onWords]);
  return null;
}
