import { useEffect, useMemo, useRef, useState, type JSX } from 'react';

import { now } from '../clock';
import { act, prefer, store, useApp } from '../store/app';
import { selectCatalogue, selectCatalogues } from '../store/derived';
import { rosNow } from '../store/moment';
import type { Charted } from '../store/view';
import { S } from '../strings';
import { IconButton } from '../widgets/IconButton';
import { Segmented } from '../widgets/Segmented';
import { useFocusBack } from '../widgets/useFocusBack';
import { modelOf, pairsOf, plansOf, tagLabel } from './charted';
import { ChartFiles } from './ChartFiles';
import { ChartState } from './ChartState';
import { ChartTables } from './ChartTables';
import { MarksKey } from './MarksKey';
import { TIMES_HEIGHT } from './plot';
import { PlotView } from './PlotView';
import { TagChoice } from './TagChoice';
import { useLines } from './useLines';
import { useSensorsOf, useSpeciesOf } from './useSensorsOf';
import { pointsFor, useSize } from './useSize';
import { useZoomed, zoomBack, zoomBy } from './zoom';

/** Of one chart of a tag's, and of several tags' only one, without the times; CSS pixels. */
const LEAST_HEIGHT = { tag: 64, sensor: 152 } as const;
/** Height of a chart's title and margins, CSS pixels. */
const AROUND = 42;

/** The charts of a tag, or of a sensor: over the map, above the time bar whose period they have. */
export default function ChartView({ charted }: { charted: Charted }): JSX.Element {
  const sensor = useApp((state) => state.view.sensor);
  const unit = useApp((state) => state.settings.unit);
  const moment = useApp((state) => state.view.moment);
  const hasDayBefore = useApp((state) => state.settings.dayBefore);
  const catalogue = useApp(selectCatalogue);
  const both = useApp(selectCatalogues);
  const isZoomed = useZoomed();
  const [isTable, setTable] = useState(false);
  const root = useRef<HTMLElement>(null);
  useFocusBack(root);
  // The card has its own chart again, with the button that led here.
  useEffect(
    () => () => {
      requestAnimationFrame(() => {
        if (document.activeElement !== document.body) return;
        const from = document.querySelector<HTMLElement>('.card-chart > .text-button');
        from?.focus({ preventScroll: true });
        from?.parentElement?.scrollIntoView({ block: 'nearest' });
      });
    },
    [],
  );
  const body = useRef<HTMLDivElement>(null);
  const size = useSize(body);
  const [tagId = ''] = charted.tagIds;
  const sensors = useSensorsOf(tagId);

  const plans = useMemo(() => plansOf(charted, sensors, sensor), [charted, sensors, sensor]);
  const pairs = useMemo(() => pairsOf(plans), [plans]);
  const asked = useLines(pairs, pointsFor(size.width), hasDayBefore);
  const { lines, span, nowS } = asked;
  const species = useSpeciesOf(charted.tagIds);
  const models = useMemo(
    () =>
      span
        ? plans.map((plan) =>
            modelOf(catalogue, both, plan, species, lines, span, unit, moment, nowS),
          )
        : [],
    [catalogue, both, plans, species, lines, span, unit, moment, nowS],
  );
  const withLines = models.filter(({ lines }) => lines.length > 0);
  const room = (size.height - TIMES_HEIGHT) / Math.max(1, plans.length);
  const least = LEAST_HEIGHT[charted.by];
  const height = Math.max(least, Math.floor(room) - AROUND);

  const zoom = (factor: number) => (): void => {
    const nowS = rosNow(store.get(), now());
    if (span && nowS !== null) zoomBy(span, factor, nowS);
  };

  return (
    <section ref={root} className="chart-view" aria-label={S.charts} data-testid="chart-view">
      <header>
        <h2 className={charted.by === 'tag' ? undefined : 'unseen'}>
          <bdi>{charted.by === 'tag' ? tagLabel(tagId) : S.charts}</bdi>
        </h2>
        <Segmented
          legend={S.chartsByLegend}
          value={charted.by}
          options={[
            { value: 'tag', label: S.chartsBy.tag },
            { value: 'sensor', label: S.chartsBy.sensor },
          ]}
          onChange={(by) => {
            act({ type: 'chart', chart: { by, tagIds: charted.tagIds } });
          }}
        />
        <div className="chart-tools">
          <IconButton
            icon="later"
            label={S.chartDayBefore}
            aria-pressed={hasDayBefore}
            onClick={() => {
              prefer({ dayBefore: !hasDayBefore });
            }}
          />
          <IconButton data-zoom icon="plus" label={S.zoomIn} onClick={zoom(0.5)} />
          <IconButton data-zoom icon="minus" label={S.zoomOut} onClick={zoom(2)} />
          {isZoomed && <IconButton icon="fit" label={S.chartWhole} onClick={zoomBack} />}
          <IconButton
            icon={isTable ? 'chart' : 'list'}
            label={isTable ? S.chartPlots : S.chartTable}
            onClick={() => {
              setTable(!isTable);
            }}
          />
          <IconButton
            icon="close"
            label={S.cardClose}
            onClick={() => {
              act({ type: 'chart', chart: null });
            }}
          />
        </div>
      </header>
      {charted.by === 'sensor' && <TagChoice tagIds={charted.tagIds} model={withLines[0]} />}
      <div className="chart-body" ref={body}>
        <ChartState
          asked={asked}
          hasLines={withLines.length > 0}
          lacks={plans.length === 0 ? S.chartNoSensors : null}
        />
        {isTable && <ChartTables models={withLines} />}
        {!isTable &&
          withLines.map((model, index) => {
            // The times of them all, below the last, are out of sight where the charts scroll.
            const hasTimes = index === withLines.length - 1 || room - AROUND < least;
            return (
              <PlotView
                // Alone, a line has other colours.
                key={`${charted.by} ${model.sensor.name}`}
                model={model}
                height={height + (hasTimes ? TIMES_HEIGHT : 0)}
                hasTimes={hasTimes}
                isAlone={charted.by === 'tag'}
              />
            );
          })}
      </div>
      <MarksKey marks={[...lines.marks.values()].flat()} />
      {withLines.length > 0 && span && (
        <ChartFiles
          models={withLines}
          span={span}
          tagId={charted.tagIds.length === 1 || charted.by === 'tag' ? tagId : undefined}
          sensor={charted.by === 'sensor' ? sensor : undefined}
        />
      )}
    </section>
  );
}
