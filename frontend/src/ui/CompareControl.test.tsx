import { fireEvent, render, screen } from '@testing-library/react';
import { beforeEach, expect, test, vi } from 'vitest';

import { act, store } from '../store/app';
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

test('a year can be typed digit by digit, and what is no moment goes on leaving', () => {
  vi.stubEnv('TZ', 'UTC');
  act({ compare: { by: 'moment', at: 1_795_000_000 } });
  render(<CompareControl />);
  const field = screen.getByLabelText<HTMLInputElement>('The moment to compare with');
  const type = (year: string): void => {
    fireEvent.change(field, { target: { value: `${year}-11-18T11:06:40` } });
  };
  type('0002');
  expect(field.value).toContain('0002-11-18');
  expect(store.get().view.compare).toEqual({ by: 'moment', at: 1_795_000_000 });
  type('2025');
  expect(store.get().view.compare).toEqual({ by: 'moment', at: 1_795_000_000 - 365 * 86_400 });
  type('0020');
  fireEvent.blur(field);
  expect(field.value).toContain('2025-11-18');
  vi.unstubAllEnvs();
});
