import type { JSX } from 'react';

import { MapView } from '../map/MapView';
import { useApp } from '../store/app';
import { S } from '../strings';
import { Legend } from './Legend';
import { MapControls } from './MapControls';
import { Notices } from './Notices';
import { Readout, ScaleBar } from './Readout';
import { SensorPicker } from './SensorPicker';
import { TagCard } from './TagCard';

export function MapPanel({ kiosk }: { kiosk: boolean }): JSX.Element {
  const selected = useApp((state) => state.view.selected);
  return (
    <section className="map-panel" aria-label={S.mapRegion}>
      <SensorPicker />
      <div className="map-frame">
        <MapView />
        <Notices />
        {!kiosk && <MapControls />}
        <ScaleBar />
        <Readout />
        {selected !== null && <TagCard key={selected} tagId={selected} />}
      </div>
      <Legend kiosk={kiosk} />
    </section>
  );
}
