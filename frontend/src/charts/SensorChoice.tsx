import { useMemo, type JSX } from 'react';

import { isHad } from '../domain/sensors';
import { shown } from '../domain/text';
import { act, useApp } from '../store/app';
import { selectCatalogue } from '../store/derived';
import { S } from '../strings';
import { useSensorsOf } from './useSensorsOf';

/** Which sensor of a tag is charted; what is computed of its sensors is among them. */
export function SensorChoice({ tagId, value }: { tagId: string; value: string }): JSX.Element {
  const sensors = useSensorsOf(tagId);
  const catalogue = useApp(selectCatalogue);
  const choices = useMemo(() => {
    const computed = catalogue.all.filter((sensor) =>
      isHad(sensor, (name) => sensors.includes(name)),
    );
    const names = new Set([...sensors, ...computed.map(({ name }) => name)]);
    return [...names].map((name) => catalogue.named(name));
  }, [catalogue, sensors]);
  return (
    <select
      aria-label={S.sensors}
      value={value}
      onChange={(event) => {
        act({ type: 'sensor', sensor: event.target.value });
      }}
    >
      {choices.map(({ name, label }) => (
        <option key={name} value={name}>
          {shown(label, 32)}
        </option>
      ))}
    </select>
  );
}
