import type { JSX } from 'react';

import { fetchExpected } from '../contract/estimate';
import type { TagHealth } from '../contract/types';
import { valueText } from '../domain/format';
import { shown } from '../domain/text';
import type { Tag } from '../domain/twin';
import { useApp } from '../store/app';
import { selectCatalogue, selectSensor } from '../store/derived';
import { selectShown } from '../store/moment';
import { estimateText } from './texts';
import { useAsked } from './useAsked';
import { E } from './words';

/** What was measured at a tag against what all else foretells for it, and what was left out. */
export function CardEstimate({
  tag,
  health,
}: {
  tag: Tag;
  health: TagHealth | undefined;
}): JSX.Element | null {
  const sensor = useApp(selectSensor);
  const catalogue = useApp(selectCatalogue);
  const unit = useApp((state) => state.settings.unit);
  // Of the past nobody tells what was expected.
  const isNow = useApp((state) => selectShown(state).moment === null);
  const { value } = useAsked(fetchExpected);
  const own = isNow && value && Object.hasOwn(value, tag.id) ? value[tag.id] : undefined;
  const changed = new Set(
    (health?.reasons ?? []).filter(({ kind }) => kind === 'changed').map((each) => each.sensor),
  );
  if (own?.left_out) changed.add(sensor.name);
  if (!own && changed.size === 0) return null;
  return (
    <div className="card-estimate" data-testid="card-estimate">
      {own && (
        <p>
          {shown(sensor.label, 32)}:{' '}
          {E.expected(
            valueText(sensor, own.measured, unit),
            estimateText(sensor, own.expected, own.expected_sd, unit),
          )}
        </p>
      )}
      {[...changed].map((name) => (
        <p key={name} data-left-out={name}>
          {E.leftOut(shown(catalogue.named(name).label, 32))}
        </p>
      ))}
    </div>
  );
}
