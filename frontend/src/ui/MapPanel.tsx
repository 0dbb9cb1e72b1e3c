import type { JSX } from 'react';

import { MapView } from '../map/MapView';
import { useApp } from '../store/app';
import { selectShown } from '../store/moment';
import { S } from '../strings';
import { HoverCard } from './HoverCard';
import { Legend } from './Legend';
import { MapControls } from './MapControls';
import { Notices } from './Notices';
import { Readout, ScaleBar } from './Readout';
import { SensorPicker } from './SensorPicker';

export function MapPanel({ kiosk }: { kiosk: boolean }): JSX.Element {
  const mapState = useApp((state) => selectShown(state).map.state);
  return (
    <section className="map-panel" aria-label={S.mapRegion} data-map-state={mapState}>
      <SensorPicker />
      <div className="map-frame">
        <MapView kiosk={kiosk} />
        <Notices place="middle" />
        {!kiosk && <MapControls />}
        <div className="map-foot">
          <Readout />
          <ScaleBar />
          <Notices place="edge" />
        </div>
        <HoverCard />
      </div>
      <Legend kiosk={kiosk} />
    </section>
  );
}
