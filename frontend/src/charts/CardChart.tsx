import { useRef, type JSX } from 'react';

import { act, useApp } from '../store/app';
import { withChart } from '../store/view';
import { S } from '../strings';
import { Icon } from '../widgets/controls';
import { useSize } from '../widgets/useSize';
import { ChartState, MarksKey, PlotView, SensorChoice } from './PlotView';
import { chosenSensor, pointsFor, useCharts, useChosenSensor, useSensorsOf } from './useCharts';

const HEIGHT = 172;

/** The sensor chosen here, the one in view, or the tag's first, over the time bar's period. */
export default function CardChart({ tagId }: { tagId: string }): JSX.Element | null {
  const inView = useApp((state) => state.view.sensor);
  const sensors = useSensorsOf(tagId);
  const chosen = useChosenSensor();
  const sensor = [chosen, inView].find((name) => sensors.includes(name)) ?? sensors[0];
  const place = useRef<HTMLDivElement>(null);
  const { width } = useSize(place);
  const own = sensor === undefined ? [] : [sensor];
  const charts = useCharts(own, [tagId], pointsFor(width));
  const { state } = charts;
  const [model] = charts.models;
  if (sensor === undefined) return null;
  return (
    <div className="card-chart" ref={place} data-testid="card-chart" data-state={state}>
      <SensorChoice
        tagId={tagId}
        value={sensor}
        onChange={(name) => {
          chosenSensor.set({ name, inView });
        }}
      />
      <button
        type="button"
        className="text-button"
        onClick={() => {
          act(withChart({ by: 'tag', tagIds: [tagId] }));
        }}
      >
        <Icon name="chart" size={16} />
        {S.charts}
      </button>
      {model && model.lines.length > 0 ? (
        <>
          <PlotView key={sensor} model={model} height={HEIGHT} />
          <MarksKey marks={model.lines.flatMap(({ marks }) => marks)} />
        </>
      ) : (
        <ChartState charts={charts} hasLines={false} lacks={null} />
      )}
    </div>
  );
}
