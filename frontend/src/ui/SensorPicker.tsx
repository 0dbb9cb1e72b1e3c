import { useEffect, useRef, type JSX } from 'react';

import { rgbText, sensorColour } from '../domain/ramp';
import type { Sensor } from '../domain/sensors';
import { shown } from '../domain/text';
import { act, useApp } from '../store/app';
import { selectSensors } from '../store/derived';
import { S } from '../strings';
import { Segmented } from '../widgets/controls';

/** Which sensor the map shows. */
export function SensorPicker(): JSX.Element {
  const sensors = useApp(selectSensors);
  const sensor = useApp((state) => state.view.sensor);
  const root = useRef<HTMLDivElement>(null);
  // The chosen one may be out of sight: by a link, by its key, or in a narrower window.
  const showChosen = (): void => {
    root.current
      ?.querySelector('input:checked')
      ?.parentElement?.scrollIntoView({ block: 'nearest', inline: 'nearest' });
  };
  useEffect(showChosen, [sensor]);
  useEffect(() => {
    const row = root.current;
    if (!row) return undefined;
    const look = (): void => {
      const isMoreBefore = row.scrollLeft > 1;
      const isMoreAfter = row.scrollLeft + row.clientWidth < row.scrollWidth - 1;
      row.dataset['more'] = `${isMoreBefore ? 'before' : ''} ${isMoreAfter ? 'after' : ''}`.trim();
    };
    const watch = new ResizeObserver(() => {
      showChosen();
      look();
    });
    // A mouse wheel turns one way only, and the row goes the other.
    const turn = ({ deltaX, deltaY }: WheelEvent): void => {
      if (deltaX === 0) row.scrollLeft += deltaY;
    };
    watch.observe(row);
    for (const child of row.children) watch.observe(child);
    row.addEventListener('scroll', look, { passive: true });
    row.addEventListener('wheel', turn, { passive: true });
    return () => {
      watch.disconnect();
      row.removeEventListener('scroll', look);
      row.removeEventListener('wheel', turn);
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
              <SensorLabel sensor={each} />
            </>
          ),
        }))}
        onChange={(name) => {
          act({ sensor: name });
        }}
      />
    </div>
  );
}

/** In short where the name is long: the full one to be heard, and to be had by pointing at it. */
export function SensorLabel({
  sensor,
  most = 0,
}: {
  sensor: Sensor;
  /** A name of so many letters is none of the long ones. */
  most?: number;
}): JSX.Element {
  const label = shown(sensor.label, 32);
  const short = shown(label.length > most ? S.sensorShort(label) : label, 24);
  if (short === label) return <span>{label}</span>;
  return (
    <span title={label}>
      <span aria-hidden="true">{short}</span>
      <span className="unseen">{label}</span>
    </span>
  );
}
