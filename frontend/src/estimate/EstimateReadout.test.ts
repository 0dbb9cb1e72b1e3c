import { expect, test } from 'vitest';

import { houseHealth } from '../domain/health';
import { snapshotOf } from '../domain/twin';
import { mapPoint } from '../geometry/coordinates';
import { judgement, reason } from '../testing/health';
import { readings, stateFrame, wireTag } from '../testing/tags';
import { NEAR_M, nearTo } from './parts';

const tag = (id: string, x: number, over = {}): ReturnType<typeof wireTag> =>
  wireTag({
    tag_id: id,
    pose: { position: { x, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } },
    readings: readings({ temperature: 20 }),
    ...over,
  });

test('counts the tags within reach that read the sensor and are not left out', () => {
  const wire = [
    tag('at the limit', NEAR_M),
    tag('past it', NEAR_M + 0.01),
    tag('reads another', 1, { readings: readings({ co2: 400 }) }),
    tag('failed', 1, { readings: readings({ temperature: null }) }),
    tag('changed', 1),
    tag('changed in another', 1),
  ];
  const { tags } = snapshotOf(stateFrame(wire), 0, null);
  const health = houseHealth(
    tags,
    judgement({
      changed: [reason({ kind: 'changed', sensor: 'temperature' })],
      'changed in another': [reason({ kind: 'changed', sensor: 'co2' })],
    }),
    true,
  );
  expect(nearTo(mapPoint(0, 0), tags, 'temperature', health).count).toBe(2);
  expect(nearTo(mapPoint(99, 0), tags, 'temperature', health)).toEqual({
    count: 0,
    oldest: 'never',
  });
});
