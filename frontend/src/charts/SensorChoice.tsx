import { useMemo, type JSX } from 'react';

import { isHad } from '../domain/sensors';
import { shown } from '../domain/text';
import { useApp } from '../store/app';
import { selectCatalogue } from '../store/derived';
import { S } from '../strings';
import { Select } from '../widgets/Select';
import { useSensorsOf } from './useSensorsOf';

/** Which sensor of a tag is charted; what is computed of its sensors is among them. */
export function SensorChoice({
  tagId,
  value,
  onChange,
}: {
  tagId: string;
  value: string;
  onChange: (sensor: string) => void;
}): JSX.Element {
  const sensors = useSensorsOf(tagId);
  const catalogue = useApp(selectCatalogue);
  const choices = useMemo(() => {
    const computed = catalogue.all.filter((sensor) =>
      isHad(sensor, (name) => sensors.includes(name)),
    );
    return [...new Set([...sensors, ...computed.map(({ name }) => name)])];
  }, [catalogue, sensors]);
  return (
    <Select
      aria-label={S.sensors}
      value={value}
      options={choices}
      text={(name) => shown(catalogue.named(name).label, 32)}
      onChange={onChange}
    />
  );
}
