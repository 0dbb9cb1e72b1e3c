import { useEffect, useRef, type JSX } from 'react';

import { rgbText, sensorColour } from '../domain/ramp';
import type { Sensor } from '../domain/sensors';
import { shown } from '../domain/text';
import { act, useApp } from '../store/app';
import { selectCatalogue, selectSensors } from '../store/derived';
import { S } from '../strings';
import { Segmented } from '../widgets/controls';

/** Chooses the sensor that the map shows. */
export function SensorPicker(): JSX.Element {
  const sensors = useApp(selectSensors);
  const catalogue = useApp(selectCatalogue);
  const sensor = useApp((state) => state.view.sensor);
  const root = useRef<HTMLDivElement>(null);
  // A link, a shortcut or a narrower window may leave the selected sensor out of view.
  const showChosen = (): void => {
    root.current
      ?.querySelector('input:checked')
      ?.parentElement?.scrollIntoView({ block: 'nearest', inline: 'nearest' });
  };
  useEffect(showChosen, [sensor]);
  useEffect(() => {
    const row = root.current;
    if (!row) return undefined;
    const watch = new ResizeObserver(() => {
      showChosen();
      look(row);
    });
    watch.observe(row);
    for (const child of row.children) watch.observe(child);
    return () => watch.disconnect();
  }, []);
  return (
    <div
      className="sensor-picker"
      ref={root}
      onScroll={({ currentTarget }) => look(currentTarget)}
      onWheel={({ currentTarget, deltaX, deltaY }) => {
        // A mouse wheel scrolls vertically; the row is horizontal.
        if (deltaX === 0) currentTarget.scrollLeft += deltaY;
      }}
    >
      <Segmented
        legend={S.sensors}
        className="sensors"
        value={sensor}
        options={sensors.map((each) => each.name)}
        text={(name) => <Swatch sensor={catalogue.named(name)} />}
        onChange={(name) => act({ sensor: name })}
      />
    </div>
  );
}

const Swatch = ({ sensor }: { sensor: Sensor }): JSX.Element => (
  <>
    <span className="swatch" style={{ background: rgbText(sensorColour(sensor)) }} />
    <SensorLabel sensor={sensor} />
  </>
);

/** Marks the sides where more sensors are out of view. */
function look(row: HTMLElement): void {
  const isMoreBefore = row.scrollLeft > 1;
  const isMoreAfter = row.scrollLeft + row.clientWidth < row.scrollWidth - 1;
  row.dataset['more'] = `${isMoreBefore ? 'before' : ''} ${isMoreAfter ? 'after' : ''}`.trim();
}

/** A long sensor name in short; screen readers and the tooltip have the full name. */
export function SensorLabel({
  sensor,
  most = 0,
}: {
  sensor: Sensor;
  /** Names up to this many characters are not shortened. */
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
