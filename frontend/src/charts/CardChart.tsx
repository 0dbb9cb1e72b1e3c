import { useMemo, useRef, type JSX } from 'react';

import { act, useApp } from '../store/app';
import { selectCatalogue, selectCatalogues } from '../store/derived';
import { S } from '../strings';
import { Icon } from '../widgets/controls';
import { modelOf, pairsOf } from './model';
import { ChartState, MarksKey, PlotView, SensorChoice } from './PlotView';
import {
  chosenSensor,
  pointsFor,
  useChosenSensor,
  useLines,
  useSensorsOf,
  useSize,
  useSpeciesOf,
} from './useLines';

const HEIGHT = 172;

/** The sensor that was chosen here, the one in view, or the tag's first, over the period of the time bar. */
export default function CardChart({ tagId }: { tagId: string }): JSX.Element | null {
  const inView = useApp((state) => state.view.sensor);
  const unit = useApp((state) => state.settings.unit);
  const moment = useApp((state) => state.view.moment);
  const catalogue = useApp(selectCatalogue);
  const both = useApp(selectCatalogues);
  const sensors = useSensorsOf(tagId);
  const chosen = useChosenSensor();
  const sensor = [chosen, inView].find((name) => sensors.includes(name)) ?? sensors[0];
  const place = useRef<HTMLDivElement>(null);
  const { width } = useSize(place);
  const plan = useMemo(
    () => (sensor === undefined ? null : { sensor, tagIds: [tagId] }),
    [sensor, tagId],
  );
  const pairs = useMemo(() => (plan ? pairsOf([plan]) : []), [plan]);
  const asked = useLines(pairs, pointsFor(width));
  const { lines, state, span, nowS } = asked;
  const species = useSpeciesOf([tagId]);
  const model = useMemo(
    () =>
      plan && span
        ? modelOf(catalogue, both, plan, species, lines, span, unit, moment, nowS)
        : null,
    [catalogue, both, plan, species, lines, span, unit, moment, nowS],
  );
  if (!plan) return null;
  return (
    <div className="card-chart" ref={place} data-testid="card-chart" data-state={state}>
      <SensorChoice
        tagId={tagId}
        value={plan.sensor}
        onChange={(name) => {
          chosenSensor.dispatch({ name, inView });
        }}
      />
      {state === 'missing' ? (
        <p className="faint">{S.chartMissingShort}</p>
      ) : (
        <>
          {model && model.lines.length > 0 ? (
            <>
              <PlotView key={plan.sensor} model={model} height={HEIGHT} />
              <MarksKey marks={[...lines.marks.values()].flat()} />
            </>
          ) : (
            <ChartState asked={asked} hasLines={false} lacks={null} />
          )}
          <button
            type="button"
            className="text-button"
            onClick={() => {
              act({ type: 'chart', chart: { by: 'tag', tagIds: [tagId] } });
            }}
          >
            <Icon name="chart" size={16} />
            {S.charts}
          </button>
        </>
      )}
    </div>
  );
}
