import { Fragment, type JSX, useLayoutEffect, useRef, useState } from 'react';

import { now } from '../clock';
import { exportAddress } from '../contract/past';
import { isHad } from '../domain/sensors';
import { chartCsv } from '../domain/series';
import { shown } from '../domain/text';
import type { Span } from '../domain/time';
import { saveCsv } from '../export/save';
import { act, prefer, store, useApp } from '../store/app';
import { selectCatalogue, selectSensor } from '../store/derived';
import { rosNow, selectTags } from '../store/moment';
import { type Charted, MOST_CHARTED, withChart, withTag } from '../store/view';
import { S } from '../strings';
import { Icon, IconButton, Select, useFocusBack } from '../widgets/controls';
import { useSize } from '../widgets/useSize';
import { ChartTables } from './SeriesTable';
import { ChartState, LineSign, LineValue, MarksKey, PlotView, SensorChoice } from './PlotView';
import { type PlotModel, tagLabel } from './model';
import { TIMES_HEIGHT } from './plot';
import { pointsFor, useCharts, useSensorsOf } from './useCharts';
import { useZoomed, zoomBack, zoomBy } from './zoom';

/** Least height of each chart of a tag, and of the one chart of a sensor, without the times; CSS pixels. */
const LEAST_HEIGHT = { tag: 80, sensor: 152 } as const;
/** Height of a chart's title, CSS pixels. */
const AROUND = 32;

/** The charts of a tag or a sensor, in place of map and list; they have the time bar's period. */
export default function ChartView({ charted }: { charted: Charted }): JSX.Element {
  const sensor = useApp((state) => state.view.sensor);
  const hasDayBefore = useApp((state) => state.settings.dayBefore);
  const isZoomed = useZoomed();
  const [isTable, setTable] = useState(false);
  const root = useRef<HTMLElement>(null);
  useFocusBack(root);
  // What led here is out of sight. On closing, the card shows its own chart again, with the button for these.
  useLayoutEffect(() => {
    root.current?.focus({ preventScroll: true });
    return () => {
      requestAnimationFrame(() => {
        if (document.activeElement !== document.body) return;
        const from = document.querySelector<HTMLElement>('.card-chart > .text-button');
        from?.focus({ preventScroll: true });
        from?.parentElement?.scrollIntoView({ block: 'nearest' });
      });
    };
  }, []);
  const body = useRef<HTMLDivElement>(null);
  const size = useSize(body);
  const [tagId = ''] = charted.tagIds;
  const sensors = useSensorsOf(tagId);
  const tags = useApp(selectTags);
  // A tag in a link may not be received yet.
  const offered = [...new Set([...tags.map(({ id }) => id), tagId])];

  const names = charted.by === 'sensor' ? [sensor] : sensors;
  const tagIds = charted.by === 'sensor' ? charted.tagIds : [tagId];
  const charts = useCharts(names, tagIds, pointsFor(size.width), hasDayBefore);
  const { span, models } = charts;
  const withLines = models.filter(({ lines }) => lines.length > 0);
  const room = (size.height - TIMES_HEIGHT) / Math.max(1, names.length);
  const least = LEAST_HEIGHT[charted.by];
  const scrolls = room - AROUND < least;
  // Whole charts, and the title of the next one as a sign that more follow.
  const around = AROUND + TIMES_HEIGHT;
  const visible = size.height - AROUND;
  const whole = Math.floor(visible / (least + around)) || 1;
  const height = scrolls
    ? Math.max(least, Math.floor(visible / whole) - around)
    : Math.floor(room) - AROUND;

  const zoom = (factor: number) => (): void => {
    const nowS = rosNow(store.get(), now());
    if (span && nowS !== null) zoomBy(span, factor, nowS);
  };

  return (
    <section
      ref={root}
      className="chart-view"
      aria-label={S.charts}
      tabIndex={-1}
      data-testid="chart-view"
    >
      <header>
        {/* To the eye, the menu says it; on paper there is none. */}
        <h2 className="unseen">
          <bdi>{charted.by === 'tag' ? tagLabel(tagId) : S.charts}</bdi>
        </h2>
        {charted.by === 'tag' && (
          <Select
            aria-label={S.tags}
            value={tagId}
            options={offered}
            text={tagLabel}
            onChange={(next) => act(withTag(next))}
          />
        )}
        <button
          type="button"
          className="text-button"
          aria-pressed={charted.by === 'sensor'}
          onClick={() => {
            const by = charted.by === 'tag' ? 'sensor' : 'tag';
            act(withChart({ by, tagIds: charted.tagIds }));
          }}
        >
          {S.chartsSeveral}
        </button>
        <div className="chart-tools">
          <IconButton
            icon="later"
            label={S.chartDayBefore}
            aria-pressed={hasDayBefore}
            onClick={() => prefer({ dayBefore: !hasDayBefore })}
          />
          <IconButton data-zoom icon="plus" label={S.zoomIn} onClick={zoom(0.5)} />
          <IconButton data-zoom icon="minus" label={S.zoomOut} onClick={zoom(2)} />
          {isZoomed && <IconButton icon="fit" label={S.chartWhole} onClick={zoomBack} />}
          <IconButton
            icon={isTable ? 'chart' : 'list'}
            label={isTable ? S.chartPlots : S.chartTable}
            onClick={() => setTable(!isTable)}
          />
          <button
            type="button"
            className="text-button chart-close"
            onClick={() => act(withChart(null))}
          >
            <Icon name="close" />
            {S.cardClose}
          </button>
        </div>
      </header>
      {charted.by === 'sensor' && <TagChoice tagIds={charted.tagIds} model={withLines[0]} />}
      <div className="chart-body" ref={body}>
        <ChartState
          charts={charts}
          hasLines={withLines.length > 0}
          lacks={names.length === 0 ? S.chartNoSensors : null}
        />
        {isTable && <ChartTables models={withLines} />}
        {!isTable &&
          withLines.map((model, index) => {
            // The shared times, below the last chart, are out of sight if the charts scroll.
            const hasTimes = index === withLines.length - 1 || scrolls;
            return (
              <PlotView
                // A single line has other colours.
                key={`${charted.by} ${model.sensor.name}`}
                model={model}
                height={height + (hasTimes ? TIMES_HEIGHT : 0)}
                hasTimes={hasTimes}
                isAlone={charted.by === 'tag'}
              />
            );
          })}
      </div>
      <MarksKey marks={models[0]?.lines.flatMap(({ marks }) => marks) ?? []} />
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

/** The tags of one chart and their values: each can be removed, and others added. */
function TagChoice({
  tagIds,
  model,
}: {
  tagIds: readonly string[];
  /** Undefined: nothing received yet. */
  model: PlotModel | undefined;
}): JSX.Element {
  const sensor = useApp(selectSensor);
  const tags = useApp(selectTags);
  const others = tags.filter(
    ({ id, readings }) => isHad(sensor, (name) => readings.has(name)) && !tagIds.includes(id),
  );
  const choose = (next: readonly string[]): void => act(withChart({ by: 'sensor', tagIds: next }));
  return (
    <div className="chart-tags">
      <SensorChoice
        tagId={tagIds[0] ?? ''}
        value={sensor.name}
        onChange={(name) => act({ sensor: name })}
      />
      {tagIds.length < MOST_CHARTED && others.length > 0 && (
        <select
          aria-label={S.chartAddTag}
          value=""
          onChange={(event) => choose([...tagIds, event.target.value])}
        >
          <option value="" disabled>
            {S.chartAddTag}
          </option>
          {others.map(({ id }) => (
            <option key={id} value={id}>
              {tagLabel(id)}
            </option>
          ))}
        </select>
      )}
      <ul aria-label={S.tags}>
        {tagIds.map((tagId, look) => (
          <li key={tagId}>
            <LineSign look={look} />
            {/* As the map's labels are. */}
            <bdi>{shown(tagId, 24)}</bdi>
            {model?.lines
              .filter(({ series }) => series.tagId === tagId)
              .map((line) => (
                <Fragment key={tagId}>
                  · <LineValue line={line} model={model} />
                </Fragment>
              ))}
            {tagIds.length > 1 && (
              <button
                type="button"
                className="chip-close"
                aria-label={S.chartRemoveTag(shown(tagId, 24))}
                onClick={() => choose(tagIds.filter((each) => each !== tagId))}
              >
                <Icon name="close" size={14} />
              </button>
            )}
          </li>
        ))}
      </ul>
    </div>
  );
}

function ChartFiles({
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
          );
          saveCsv('chart', text, span.to * 1000);
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
