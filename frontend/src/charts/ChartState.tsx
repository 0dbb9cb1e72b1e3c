import type { JSX } from 'react';

import { shown } from '../domain/text';
import { S } from '../strings';
import { More } from '../widgets/More';
import type { Fed } from './fed';

/** Why there is no chart (yet), in plain words. */
export function ChartState({
  fed,
  isTimeKnown,
  lacks,
}: {
  fed: Fed;
  isTimeKnown: boolean;
  /** What there is nothing of to chart; null: there is something. */
  lacks: string | null;
}): JSX.Element | null {
  const { state, message, series } = fed;
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
    (!isTimeKnown
      ? S.chartNoTime
      : state === 'failed'
        ? S.chartFailed(shown(message, 300))
        : state === 'waiting' && series.size === 0
          ? S.chartLoading
          : null);
  if (text === null) return null;
  return (
    <div className="chart-state" role="status" data-state={state}>
      {text}
    </div>
  );
}
