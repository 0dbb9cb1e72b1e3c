import { Fragment, type JSX } from 'react';

import { isHad } from '../domain/sensors';
import { shown } from '../domain/text';
import { act, useApp } from '../store/app';
import { selectSensor } from '../store/derived';
import { selectTags } from '../store/moment';
import { MOST_CHARTED } from '../store/view';
import { S } from '../strings';
import { Icon } from '../widgets/Icon';
import { tagLabel } from './charted';
import { LineSign, LineValue } from './LineValue';
import type { PlotModel } from './model';
import { SensorChoice } from './SensorChoice';

/** The tags of one chart with what their lines say: each can go, and another be added. */
export function TagChoice({
  tagIds,
  model,
}: {
  tagIds: readonly string[];
  /** Undefined: nothing of it is here yet. */
  model: PlotModel | undefined;
}): JSX.Element {
  const sensor = useApp(selectSensor);
  const tags = useApp(selectTags);
  const others = tags.filter(
    ({ id, readings }) => isHad(sensor, (name) => readings.has(name)) && !tagIds.includes(id),
  );
  const choose = (next: readonly string[]): void => {
    act({ type: 'chart', chart: { by: 'sensor', tagIds: next } });
  };
  return (
    <div className="chart-tags">
      <SensorChoice
        tagId={tagIds[0] ?? ''}
        value={sensor.name}
        onChange={(name) => {
          act({ type: 'sensor', sensor: name });
        }}
      />
      <ul aria-label={S.tags}>
        {tagIds.map((tagId, look) => (
          <li key={tagId}>
            <LineSign look={look} />
            {/* As the map's labels are. */}
            <bdi>{shown(tagId, 24)}</bdi>
            {model?.lines
              .filter(({ series }) => series.tagId === tagId)
              .map((line) => (
                <Fragment key={tagId}>
                  · <LineValue line={line} model={model} />
                </Fragment>
              ))}
            {tagIds.length > 1 && (
              <button
                type="button"
                className="chip-close"
                aria-label={S.chartRemoveTag(shown(tagId, 24))}
                onClick={() => {
                  choose(tagIds.filter((each) => each !== tagId));
                }}
              >
                <Icon name="close" size={14} />
              </button>
            )}
          </li>
        ))}
      </ul>
      {tagIds.length < MOST_CHARTED && others.length > 0 && (
        <select
          aria-label={S.chartAddTag}
          value=""
          onChange={(event) => {
            choose([...tagIds, event.target.value]);
          }}
        >
          <option value="" disabled>
            {S.chartAddTag}
          </option>
          {others.map(({ id }) => (
            <option key={id} value={id}>
              {tagLabel(id)}
            </option>
          ))}
        </select>
      )}
    </div>
  );
}
