import { useEffect, useRef, type JSX } from 'react';

import { rgbText, sensorColour } from '../domain/ramp';
import { shown } from '../domain/text';
import { unitOf } from '../domain/units';
import { act, useApp } from '../store/app';
import { selectSensors } from '../store/derived';
import { S } from '../strings';
import { Segmented } from '../widgets/Segmented';

/** Which sensor the map shows. */
export function SensorPicker(): JSX.Element {
  const sensors = useApp(selectSensors);
  const sensor = useApp((state) => state.view.sensor);
  const unit = useApp((state) => state.settings.unit);
  const root = useRef<HTMLDivElement>(null);
  // On a phone the chosen one may be out of sight: by a link, or by its key.
  useEffect(() => {
    root.current
      ?.querySelector('input:checked')
      ?.parentElement?.scrollIntoView({ block: 'nearest', inline: 'nearest' });
  }, [sensor]);
  useEffect(() => {
    const row = root.current;
    if (!row) return undefined;
    const look = (): void => {
      const isMoreBefore = row.scrollLeft > 1;
      const isMoreAfter = row.scrollLeft + row.clientWidth < row.scrollWidth - 1;
      row.dataset['more'] = `${isMoreBefore ? 'before' : ''} ${isMoreAfter ? 'after' : ''}`.trim();
    };
    const watch = new ResizeObserver(look);
    watch.observe(row);
    for (const child of row.children) watch.observe(child);
    row.addEventListener('scroll', look, { passive: true });
    return () => {
      watch.disconnect();
      row.removeEventListener('scroll', look);
    };
  }, []);
  return (
    <div className="sensor-picker" ref={root}>
      <Segmented
        legend={S.sensors}
        className="sensors"
        value={sensor}
        options={sensors.map((each) => ({
          value: each.name,
          label: (
            <>
              <span className="swatch" style={{ background: rgbText(sensorColour(each)) }} />
              <span className="sensor-label">{shown(each.label, 32)}</span>
              <span className="sensor-unit">{unitOf(each, unit)}</span>
            </>
          ),
        }))}
        onChange={(name) => {
          act({ type: 'sensor', sensor: name });
        }}
      />
    </div>
  );
}
