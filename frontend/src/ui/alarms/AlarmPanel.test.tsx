import { act as flush, fireEvent, render, screen, within } from '@testing-library/react';
import { afterEach, beforeEach, expect, test, vi } from 'vitest';

import { NOTHING_KEPT } from '../../alarms/kept';
import { own } from '../../alarms/own';
import { startAlarms } from '../../alarms/watch';
import { notifyState } from '../../alarms/notify';
import type { Alarm } from '../../contract/types';
import { act, receive, store } from '../../store/app';
import { NO_HOUSE } from '../../store/twin';
import { alarm, alarms, tellAlarms } from '../../testing/alarms';
import { goLost, showTags } from '../../testing/page';
import { wireTag } from '../../testing/tags';
import { AlarmPanel } from './AlarmPanel';

let stop: () => void;

beforeEach(() => {
  own.dispatch(NOTHING_KEPT);
  showTags([wireTag()]);
  stop = startAlarms();
  render(<AlarmPanel />);
});
afterEach(() => {
  stop();
});

const tell = (...list: readonly Alarm[]): void => {
  flush(() => {
    tellAlarms(...list);
  });
};
const group = (name: string): HTMLElement[] => [
  ...document.querySelectorAll<HTMLElement>(`[data-group=${name}] li`),
];
const first = (name: string): HTMLElement => {
  const [row] = group(name);
  if (!row) throw new Error(`no row in ${name}`);
  return row;
};
const notes = (): (string | undefined)[] =>
  [...document.querySelectorAll<HTMLElement>('[data-note]')].map(({ dataset }) => dataset['note']);
const press = (name: RegExp | string): void => {
  fireEvent.click(screen.getByRole('button', { name }));
};

test('each in words: what, where, since when, how bad at worst; what is over until when', () => {
  tell(
    alarm('a', { tag_id: '5', raised: 500, worst: 4.2 }),
    alarm('b', { tag_id: '', raised: 100, cleared: 160, reason: { kind: 'stopped', sensor: '' } }),
  );
  const [active] = group('active');
  expect(active?.textContent).toContain('Tag 5: Temperature 6.6\u00a0°C, below 10.0');
  expect(active?.textContent).toContain('since sim 00:08:20');
  expect(active?.textContent).toContain('at worst 4.2\u00a0°C (critical)');
  const over = first('over');
  expect(over.textContent).toContain('Whole house: No tag is being scanned');
  expect(over.textContent).toContain('sim 00:01:40 until sim 00:02:40 (1\u00a0min)');
  expect(within(over).queryByRole('button', { name: /^Put aside/ })).toBeNull();
});

test('seen, put aside, taken back', () => {
  tell(alarm('a', { tag_id: '5' }), alarm('b', { tag_id: '6' }));
  press(/^Mark seen: Tag 5/);
  expect(group('active').map(({ dataset }) => dataset['seen'])).toEqual(['true', 'false']);
  press(/^Put aside: Tag 6/);
  press('For 1 h');
  expect(group('active')).toHaveLength(1);
  expect(group('shelved')[0]?.textContent).toMatch(/put aside until \d\d:\d\d:\d\d/);
  press(/^Take back: Tag 6/);
  expect(group('active')).toHaveLength(2);
  press('Mark all seen');
  expect(group('active').map(({ dataset }) => dataset['seen'])).toEqual(['true', 'true']);
  expect(screen.getByRole<HTMLButtonElement>('button', { name: 'Mark all seen' }).disabled).toBe(
    true,
  );
});

test('a row leads to its tag', () => {
  tell(alarm('a', { tag_id: '5' }));
  fireEvent.click(within(first('active')).getByText(/Temperature/));
  expect(store.get().view.selected).toBe('5');
});

test('without an alarm it says so; where that is not known it says that', () => {
  expect(notes()).toEqual(['unknown']);
  flush(() => {
    receive({ type: 'alarms', alarms: alarms([], { source: 'starting', since: null }) });
  });
  expect(notes()).toEqual(['starting', 'unknown']);
  tell();
  expect(notes()).toEqual(['none']);
  expect(screen.getByText('No alarm is active')).toBeTruthy();
  flush(() => {
    receive({ type: 'alarms', alarms: alarms([], { source: 'heard' }) });
  });
  expect(notes()).toEqual(['none', 'heard']);
  tell();
  flush(goLost);
  expect(notes()).toEqual(['lost', 'unknown']);
});

test('it is of now, and says so while another moment is shown', () => {
  tell(alarm('a'));
  expect(notes()).toEqual([]);
  flush(() => {
    act({ type: 'moment', moment: 50 });
    receive({ type: 'past', past: { at: 50, house: NO_HOUSE } });
  });
  expect(notes()).toEqual(['now']);
  expect(screen.getByText(/alarms of now.*sim 00:00:50/)).toBeTruthy();
  expect(group('active')).toHaveLength(1);
});

test('of many a hundred at a time', () => {
  tell(...Array.from({ length: 150 }, (_, at) => alarm(`a${at}`, { tag_id: String(at) })));
  expect(screen.getByRole('heading').textContent).toBe('Active (150)');
  expect(group('active')).toHaveLength(100);
  press('Show 50 more');
  expect(group('active')).toHaveLength(150);
});

test('nothing makes itself heard unless it is wished, and what cannot says why', () => {
  vi.stubGlobal('isSecureContext', false);
  notifyState.dispatch('insecure');
  press('Tell me of alarms');
  const [sound, notify] = screen.getAllByRole<HTMLInputElement>('checkbox');
  expect([sound?.checked, notify?.checked, notify?.disabled]).toEqual([false, false, true]);
  expect(screen.getByText(/https:\/\/ or with http:\/\/localhost/)).toBeTruthy();
  vi.unstubAllGlobals();
});
