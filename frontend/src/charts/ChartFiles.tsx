import type { JSX } from 'react';

import { exportAddress } from '../contract/series';
import type { Span } from '../domain/period';
import { chartCsv } from '../domain/series';
import { fileName, save } from '../export/save';
import { useApp } from '../store/app';
import { selectCatalogue } from '../store/derived';
import { S } from '../strings';
import { Icon } from '../widgets/Icon';
import type { PlotModel } from './model';

/** What is shown to take away, and every reading behind it. */
export function ChartFiles({
  models,
  span,
  tagId,
  sensor,
}: {
  models: readonly PlotModel[];
  span: Span;
  tagId: string | undefined;
  sensor: string | undefined;
}): JSX.Element {
  const unit = useApp((state) => state.settings.unit);
  const catalogue = useApp(selectCatalogue);
  return (
    <footer className="chart-files">
      <p className="faint">{S.chartHint}</p>
      <button
        type="button"
        className="text-button"
        onClick={() => {
          const text = chartCsv(
            catalogue,
            models.flatMap(({ lines }) => lines),
            unit,
          );
          save(
            new Blob([text], { type: 'text/csv;charset=utf-8' }),
            fileName('chart', 'csv', span.to * 1000),
          );
        }}
      >
        <Icon name="download" size={16} />
        {S.chartCsvShown}
      </button>
      <a
        className="text-button"
        download
        data-testid="export-link"
        href={exportAddress({ ...span, tagId, sensor })}
      >
        <Icon name="download" size={16} />
        {S.chartCsvAll}
      </a>
    </footer>
  );
}
