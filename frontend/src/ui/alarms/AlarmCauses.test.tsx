import { act, fireEvent, render, screen } from '@testing-library/react';
import { afterEach, beforeEach, expect, test } from 'vitest';

import { startAlarms } from '../../alarms/watch';
import type { Alarm } from '../../contract/types';
import { alarm, reportAlarms } from '../../testing/alarms';
import { showTags } from '../../testing/page';
import { wireTag } from '../../testing/tags';
import { AlarmPanel } from './AlarmPanel';

let stop: () => void;
beforeEach(() => {
  showTags([wireTag()]);
  stop = startAlarms();
  render(<AlarmPanel />);
});
afterEach(() => {
  stop();
});

const report = (...list: readonly Alarm[]): void => {
  act(() => {
    reportAlarms(...list);
  });
};
const group = (name: string): Element[] => [
  ...document.querySelectorAll(`[data-group=${name}] [data-alarm]`),
];

test('of many of one cause five, then a hundred more at a time', () => {
  report(...Array.from({ length: 150 }, (_, at) => alarm(`a${at}`, { tag_id: String(at) })));
  // By text: a role query over hundreds of buttons takes seconds.
  expect(screen.getByText('Active (150)')).toBeTruthy();
  expect(group('active')).toHaveLength(0);
  fireEvent.click(screen.getByText(/150 alarms/));
  expect(group('active')).toHaveLength(5);
  fireEvent(window, new Event('beforeprint'));
  expect(group('active')).toHaveLength(150);
  fireEvent(window, new Event('afterprint'));
  fireEvent.click(screen.getByText('+ 100 more'));
  expect(group('active')).toHaveLength(105);
  fireEvent.click(screen.getByText('+ 45 more'));
  expect(group('active')).toHaveLength(150);
});

test('many of one cause that are resolved have nothing to do, and no time in common', () => {
  report(
    ...Array.from({ length: 5 }, (_, at) => alarm(`a${at}`, { tag_id: `${at}`, cleared: 950 })),
  );
  fireEvent.click(screen.getByText('Resolved in the last 24 h (5)'));
  const heading = screen.getByRole('button', { name: /Temperature too low · 5 alarms/ });
  expect(heading.querySelector('.alarm-do, [data-fact=since]')).toBeNull();
  // The empty tools cell stays, to align the columns.
  expect(heading.parentElement?.querySelector('.alarm-tools')?.children).toHaveLength(0);
});
