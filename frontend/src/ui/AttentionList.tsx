import { useMemo, type JSX } from 'react';

import { readingText } from '../domain/format';
import { rowsOf, sortRows } from '../domain/table';
import { sensorNamed } from '../domain/sensors';
import { shown } from '../domain/text';
import { useApp } from '../store/app';
import { selectHealth } from '../store/derived';
import { selectTags } from '../store/moment';
import { S } from '../strings';
import { Age } from './Age';
import { HealthMark } from './HealthMark';
import { PestMark } from './TagRow';

const LONGEST = 14;

/** For a wall screen: the tags that need somebody, pests first, then the worst. */
export function AttentionList(): JSX.Element {
  const tags = useApp(selectTags);
  const health = useApp(selectHealth);
  const unit = useApp((state) => state.settings.unit);
  const rows = useMemo(() => {
    const all = sortRows(rowsOf(tags, health), {
      column: 'health',
      descending: true,
    });
    const bad = all.filter(
      ({ tag, health: own }) =>
        tag.anomaly || own.status === 'critical' || own.status === 'stressed',
    );
    return [...bad.filter(({ tag }) => tag.anomaly), ...bad.filter(({ tag }) => !tag.anomaly)];
  }, [tags, health]);
  return (
    <div className="attention">
      <h3>{rows.length > 0 ? S.attention : S.attentionNone}</h3>
      <ul>
        {rows.slice(0, LONGEST).map(({ tag, health: own }) => {
          const sensor = own.sensor === null ? null : sensorNamed(own.sensor);
          const isBad = own.status === 'critical' || own.status === 'stressed';
          return (
            <li key={tag.id} data-tag-id={tag.id}>
              <strong>
                <bdi>{shown(tag.id, 16)}</bdi>
              </strong>
              <span className="attention-why">
                {isBad && sensor && own.value !== null && (
                  <>
                    <HealthMark status={own.status} word={false} /> {sensor.label}{' '}
                    {readingText(sensor, own.value, unit)}
                  </>
                )}
                {tag.anomaly && <PestMark count={tag.bugCount} />}
              </span>
              <span className="faint">
                <Age
                  when={(own.sensor === null ? null : tag.readAt.get(own.sensor)) ?? tag.scannedAt}
                />
              </span>
            </li>
          );
        })}
      </ul>
    </div>
  );
}
