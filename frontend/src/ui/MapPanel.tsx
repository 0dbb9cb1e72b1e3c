import type { JSX } from 'react';

import { differenceText } from '../domain/difference';
import { cellAt, valueAt } from '../domain/field';
import { metresText, readingText, written } from '../domain/format';
import { idealText, rangesAt } from '../domain/ideal';
import { shortRosText } from '../domain/time';
import { lengthText, scaleBar } from '../geometry/coordinates';
import { pointedAt, theMap } from '../map/commands';
import { MapView } from '../map/MapView';
import { act, useApp } from '../store/app';
import { useSelected } from '../store/create';
import { selectHeat, selectSensor, selectZones } from '../store/derived';
import { selectShown } from '../store/moment';
import { LAYERS, withLayer } from '../store/view';
import { S } from '../strings';
import { PastFrame } from '../timebar/Past';
import { Check, Disclosure, Icon, IconButton, type IconName } from '../widgets/controls';
import { HealthStrip } from './DoNow';
import { AdviceMarks, EstimateReadout, lazyPart } from './lazyParts';
import { WithParts } from './loadDeferred';
import { HeatControl, Legend } from './Legend';
import { Notices } from './Notices';
import { SensorPicker } from './SensorPicker';

// Charts and their library load after the first paint.
const ChartView = lazyPart(async () => (await import('../charts/ChartView')).default);

export function MapPanel({ kiosk }: { kiosk: boolean }): JSX.Element {
  const mapState = useApp((state) => selectShown(state).map.state);
  const isAdvised = useApp((state) => state.view.layers.has('advice'));
  const charted = useApp((state) => state.view.chart);
  return (
    <section className="map-panel" aria-label={S.mapRegion} data-map-state={mapState}>
      {!kiosk && <HealthStrip />}
      <SensorPicker />
      <div className="map-frame">
        <MapView kiosk={kiosk} />
        {isAdvised && <AdviceMarks />}
        <Notices place="middle" />
        {!kiosk && <MapControls />}
        <div className="map-foot">
          <Readout />
          <ScaleBar />
          <Notices place="edge" />
        </div>
        <WithParts>{(parts) => <parts.OnMap />}</WithParts>
        {charted && !kiosk && <ChartView charted={charted} />}
        <PastFrame />
      </div>
      <Legend kiosk={kiosk} />
      {!kiosk && <WithParts>{(parts) => <parts.TimeBar />}</WithParts>}
    </section>
  );
}

function MapControls(): JSX.Element {
  const button = (label: string, icon: IconName, action: () => void): JSX.Element => (
    <IconButton label={label} icon={icon} onClick={action} />
  );
  return (
    <div className="map-controls" data-over-map>
      <div className="stack">
        {button(S.zoomIn, 'plus', () => theMap.get()?.zoomBy(1.5))}
        {button(S.zoomOut, 'minus', () => theMap.get()?.zoomBy(1 / 1.5))}
        {button(S.fit, 'fit', () => theMap.get()?.fit())}
      </div>
      <Disclosure label={S.layersButton} button={<Icon name="layers" />} className="layers">
        <LayerList />
      </Disclosure>
    </div>
  );
}

/** There may be no robot: `RobotChoice` adds its layer. */
const LISTED = LAYERS.filter((layer) => layer !== 'robot');

function LayerList(): JSX.Element {
  const on = useApp((state) => state.view.layers);
  return (
    <>
      <div className="layer-list">
        {LISTED.map((layer) => (
          <Check
            key={layer}
            label={S.layers[layer]}
            isOn={on.has(layer)}
            onChange={(isOn) => act(withLayer(layer, isOn))}
          />
        ))}
        <WithParts>{(parts) => <parts.InLayers />}</WithParts>
      </div>
      <label className="layer-choice">
        <span>{S.heat}</span>
        <HeatControl />
      </label>
      <WithParts>{(parts) => <parts.CompareControl />}</WithParts>
    </>
  );
}

/** The field's value under the mouse or crosshair. */
export function Readout(): JSX.Element | null {
  const point = useSelected(pointedAt);
  const heat = useApp(selectHeat);
  const sensor = useApp(selectSensor);
  const difference = heat?.difference;
  const value = point && heat ? valueAt(heat.field, point) : null;
  const isOld = Boolean(point && heat?.old?.[cellAt(heat.field, point) ?? -1]);
  const ranges = useApp((state) => {
    if (!point || !heat || heat.difference || heat.isError) return null;
    const cell = cellAt(heat.field, point);
    return cell === null ? null : (rangesAt(selectZones(state, heat.field), cell) ?? null);
  });
  if (!point) return null;
  const how = value !== null && !isOld && ranges && idealText(sensor, ranges, value);
  const text = difference ? differenceText : readingText;
  return (
    <output className="readout" data-testid="readout">
      {heat?.field.sureness ? (
        <EstimateReadout point={point} field={heat.field} value={value} isError={heat.isError} />
      ) : (
        <strong>
          {value === null ? S.notKnown : text(sensor, value)}
          {difference && value !== null && (
            <span> {S.differenceSince(shortRosText(difference.against))}</span>
          )}
        </strong>
      )}
      {value !== null && isOld && <span>{S.readoutOld}</span>}
      {how && <span data-testid="readout-ideal">{how}</span>}
      <span>{S.position(metresText(point.x), metresText(point.y))}</span>
    </output>
  );
}

const LONGEST_BAR_PX = 110;

/** A round length, drawn to the map's scale. */
function ScaleBar(): JSX.Element {
  const scale = useApp((state) => state.viewport.view.scale);
  const bar = scaleBar(scale, LONGEST_BAR_PX);
  const length = written(lengthText(bar.metres));
  return (
    // Fitting the view keeps this place clear, so its size must not depend on the view.
    <div className="scale-place" data-over-map>
      <div className="scale-bar" role="img" aria-label={S.scaleBar(length)}>
        <span className="bar" style={{ width: `${bar.pixels}px` }} />
        <span>{length}</span>
      </div>
    </div>
  );
}
