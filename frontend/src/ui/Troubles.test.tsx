import { act as flush, render, screen } from '@testing-library/react';
import { beforeEach, expect, test } from 'vitest';

import { receive } from '../store/app';
import { goLive, showTags, status } from '../testing/page';
import { Troubles } from './Troubles';

beforeEach(() => {
  showTags([]);
});

const lines = (): string[] =>
  [...screen.getByTestId('troubles').querySelectorAll('p')].map((line) => line.textContent);

test('messages that could not be read are counted, and the last is named', () => {
  render(<Troubles />);
  expect(lines()).toEqual([]);
  flush(() => {
    receive({ type: 'unread', why: 'state.seq: is missing' });
  });
  expect(lines()).toEqual([
    'A message from the bridge could not be read and was dropped. The last: state.seq: is missing',
  ]);
  flush(() => {
    receive({ type: 'unread', why: 'a message that is no JSON' });
  });
  expect(lines()[0]).toMatch(/^2 messages .* The last: a message that is no JSON$/);
  flush(() => {
    receive({ type: 'unread', why: null });
  });
  expect(lines()).toEqual([]);
});

test('what the twin dropped is told with its count, and a pause as one', () => {
  goLive(
    status({
      reason: 'paused',
      drops: [{ reason: 'frame', message: 'frame odom, expected map', count: 12 }],
    }),
  );
  render(<Troubles />);
  expect(lines()).toEqual([
    'Time is paused. The simulation stands still, and so do all ages.',
    'The twin dropped 12 messages in the last minutes. The last: frame odom, expected map',
  ]);
});
