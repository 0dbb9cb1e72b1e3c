import type { JSX } from 'react';

import { MapView } from '../map/MapView';
import { useApp } from '../store/app';
import { selectShown } from '../store/moment';
import { S } from '../strings';
import { PastFrame } from '../timebar/Past';
import { HealthStrip } from './DoNow';
import { AdviceMarks } from './estimate';
import { inTime } from './inTime';
import { Legend } from './Legend';
import { MapControls } from './MapControls';
import { Notices } from './Notices';
import { Readout, ScaleBar } from './Readout';
import { SensorPicker } from './SensorPicker';
import { WithParts } from './WithParts';

// Charts come after the first paint, and their library with them.
const ChartView = inTime(async () => (await import('../charts/ChartView')).default);

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
