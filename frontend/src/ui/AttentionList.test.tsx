import { render, screen } from '@testing-library/react';
import { expect, test } from 'vitest';

import { showTags } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import { AttentionList } from './AttentionList';

const ids = (): (string | undefined)[] =>
  screen.queryAllByRole('listitem').map((item) => item.dataset['tagId']);

test('lists who needs somebody: pests first, a healthy tag’s too, then the worst', () => {
  showTags([
    wireTag({ tag_id: 'well', readings: readings({ temperature: 20 }) }),
    wireTag({ tag_id: 'warm', readings: readings({ temperature: 30 }) }),
    wireTag({ tag_id: 'hot', readings: readings({ temperature: 50 }) }),
    wireTag({
      tag_id: 'bug',
      readings: readings({ temperature: 20 }),
      anomaly: true,
      bug_count: 2,
    }),
  ]);
  render(<AttentionList />);
  expect(ids()).toEqual(['bug', 'hot', 'warm']);
  expect(screen.getAllByRole('listitem')[0]?.textContent).toMatch(/^bugPest2 bugs/);
});

test('says so when nobody does', () => {
  showTags([wireTag({ readings: readings({ temperature: 20 }) })]);
  render(<AttentionList />);
  expect(ids()).toEqual([]);
  expect(screen.getByRole('heading').textContent).toBe('Nothing needs attention');
});
