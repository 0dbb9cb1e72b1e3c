import { useEffect, useState, type JSX } from 'react';
import { flushSync } from 'react-dom';

import { epochOf, timeOfDay } from '../clock';
import { momentText, rangeText } from '../domain/format';
import { sensorNamed } from '../domain/sensors';
import { shown } from '../domain/text';
import { useApp } from '../store/app';
import { selectRange } from '../store/derived';
import { selectSnapshot } from '../store/moment';
import { S } from '../strings';

/** What and when, on paper alone: "Live" and "5 s" mean nothing an hour later. */
export function PaperLine(): JSX.Element | null {
  const [printedAt, setPrintedAt] = useState(() => timeOfDay());
  const takenAt = useApp((state) => selectSnapshot(state)?.takenAt);
  const sensor = sensorNamed(useApp((state) => state.view.sensor));
  const range = useApp(selectRange);
  const unit = useApp((state) => state.settings.unit);
  useEffect(() => {
    const onPrint = (): void => {
      // Not with the next frame: a page on its way to the printer gets none.
      flushSync(() => {
        setPrintedAt(timeOfDay());
      });
    };
    window.addEventListener('beforeprint', onPrint);
    return () => {
      window.removeEventListener('beforeprint', onPrint);
    };
  }, []);
  if (takenAt === undefined) return null;
  return (
    <p className="paper-line" data-testid="paper-line">
      <strong>{S.paper(momentText(epochOf(takenAt)), momentText(printedAt))}</strong>{' '}
      <span>{S.paperRange(shown(sensor.label, 32), rangeText(sensor, range, unit))}</span>
    </p>
  );
}
