import type { JSX } from 'react';

import { shown } from '../domain/text';
import { S } from '../strings';
import { More } from '../widgets/More';
import type { Asked } from './useLines';

/** Why there is no chart (yet), in plain words. */
export function ChartState({
  asked: { state, message, span },
  hasLines,
  lacks,
}: {
  asked: Asked;
  hasLines: boolean;
  /** What there is nothing of to chart; null: there is something. */
  lacks: string | null;
}): JSX.Element | null {
  if (state === 'missing') {
    return (
      <div className="chart-state" role="status" data-state="missing">
        <strong>{S.chartMissing}</strong>
        <p>{S.chartMissingHint}</p>
        <More label={S.more} text={S.chartMissingMore} />
        {message && <p className="faint">{shown(message, 300)}</p>}
      </div>
    );
  }
  const text =
    lacks ??
    (span === null
      ? S.chartNoTime
      : state === 'failed'
        ? S.chartFailed(shown(message, 300))
        : state === 'waiting' && !hasLines
          ? S.chartLoading
          : null);
  if (text === null) return null;
  return (
    <div className="chart-state" role="status" data-state={state}>
      {text}
    </div>
  );
}
