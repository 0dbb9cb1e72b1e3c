import { fireEvent, render, screen } from '@testing-library/react';
import { beforeEach, expect, test } from 'vitest';

import { store } from '../store/app';
import { goLive, showTags, status } from '../testing/page';
import { wireTag } from '../testing/tags';
import { CompareControl } from './CompareControl';

beforeEach(() => {
  showTags([wireTag()]);
});

test.each([
  ['of a robot', 86_400],
  ['of a demo, which is short', 1_440],
])('yesterday is a day earlier %s', (_, dayS) => {
  goLive(status({ day_length_s: dayS }));
  render(<CompareControl />);
  for (const [choice, seconds] of [
    ['day', dayS],
    ['week', 7 * dayS],
  ] as const) {
    fireEvent.change(screen.getByTestId('compare'), { target: { value: choice } });
    expect(store.get().view.compare).toEqual({ by: 'ago', seconds });
    expect(screen.getByTestId('compare')).toHaveProperty('value', choice);
  }
});
