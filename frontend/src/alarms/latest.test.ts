import { expect, test } from 'vitest';

import { store } from '../store/app';
import { alarm } from '../testing/alarms';
import { held, judgement, reason } from '../testing/health';
import { showTags } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import { NO_LOCAL_ALARMS } from './own';
import { listOf } from './list';
import { todoNow } from './latest';

const IDS = ['1', '2'];
const { active } = listOf(
  IDS.map((tag_id) => alarm(tag_id, { tag_id, reason: { value: 17, limit: 18 } })),
  NO_LOCAL_ALARMS,
  null,
  0,
);

/** The action, given each tag's temperature and, if it is back in range, its release limit. */
const todo = (...now: readonly (readonly [value: number, release?: number])[]): string => {
  const tags = IDS.map((tag_id, at) =>
    wireTag({ tag_id, readings: readings({ temperature: now[at]?.[0] ?? null }) }),
  );
  const said = now.map(([value, release]) => [
    reason({ value, limit: 18, verdict: 'stressed', ...held(release) }),
  ]);
  showTags(tags, judgement(Object.fromEntries(IDS.map((id, at) => [id, said[at] ?? []]))));
  return todoNow(store.get(), active);
};

test('nothing is ordered where all are back in their range, and something as soon as one is not', () => {
  expect(todo([17.5], [17.8])).toBe('Heat, or close the vents');
  expect(todo([18.1, 18.5], [17.8])).toBe('Heat, or close the vents');
  expect(todo([18.1, 18.5], [18.2, 18.5])).toBe('Keep an eye on it');
});
