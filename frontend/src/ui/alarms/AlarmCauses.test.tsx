import { act, fireEvent, render, screen } from '@testing-library/react';
import { afterEach, beforeEach, expect, test } from 'vitest';

import { acknowledge, NO_LOCAL_ALARMS, own } from '../../alarms/own';
import { severalNow } from '../../alarms/latest';
import { alarmList, startAlarms } from '../../alarms/watch';
import type { Alarm } from '../../contract/types';
import { store } from '../../store/app';
import { person } from '../../store/create';
import { started } from '../../testing/life';
import { alarm, reportAlarms } from '../../testing/alarms';
import { S } from '../../strings';
import { judgement, reason } from '../../testing/health';
import { showTags } from '../../testing/page';
import { readings, wireTag } from '../../testing/tags';
import { HealthSummary } from '../HealthSummary';
import { AlarmPanel } from './AlarmPanel';

let stop: () => void;
beforeEach(() => {
  own.set(NO_LOCAL_ALARMS);
  person.set(null);
  showTags([wireTag()]);
  stop = started(startAlarms);
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

test('of many of one cause the heading with the worst, then a hundred at a time', () => {
  report(...Array.from({ length: 150 }, (_, at) => alarm(`a${at}`, { tag_id: String(at) })));
  // By text: a role query over hundreds of buttons takes seconds.
  expect(screen.getByText('Active (150)')).toBeTruthy();
  expect(group('active'), 'the worst one’s values are in the heading').toEqual([]);
  expect(document.querySelector('[data-fact=of]')?.textContent).toBe('Tag 0');
  fireEvent.click(screen.getByText(/150 alarms/));
  expect(group('active')).toHaveLength(100);
  fireEvent(window, new Event('beforeprint'));
  expect(group('active')).toHaveLength(150);
  fireEvent(window, new Event('afterprint'));
  fireEvent.click(screen.getByText('+ 50 more'));
  expect(group('active')).toHaveLength(150);
  // The bridge sends no more than 1,000.
  report(...Array.from({ length: 1_000 }, (_, at) => alarm(`a${at}`, { tag_id: String(at) })));
  expect(screen.getByText('Active (1,000+)')).toBeTruthy();
  // The status above says the same.
  act(() => {
    showTags([wireTag()], judgement({ [wireTag().tag_id]: 'healthy' }));
  });
  render(<HealthSummary kiosk={false} />);
  expect(screen.getByTestId('health-driver').textContent).toMatch(/^1,000\+ alarms are still/);
});

test('only who acknowledged an alarm, or an admin, may take that back', () => {
  const anna = { can_sign_out: true, seconds_left: null, name: 'anna', can_write_notes: true };
  const isOffered = (role: 'operator' | 'admin', acknowledged_by: string | null): boolean => {
    const said = alarm('a', { acknowledged_by });
    report(said);
    act(() => {
      person.set({ ...anna, role });
      own.set(acknowledge(NO_LOCAL_ALARMS, [{ alarm: said }], 0));
    });
    fireEvent.click(screen.getByRole('button', { name: /^Actions/ }));
    const found = screen.queryByText('Unacknowledge') !== null;
    fireEvent.keyDown(document, { key: 'Escape' });
    return found;
  };
  expect(isOffered('operator', 'bert')).toBe(false);
  expect(isOffered('admin', 'bert')).toBe(true);
  expect(isOffered('operator', 'anna')).toBe(true);
  // Just acknowledged here: the frame with the name is still to come.
  expect(isOffered('operator', null)).toBe(true);
});

test('many of one cause that are resolved have nothing to do, and say when the last was', () => {
  report(
    ...Array.from({ length: 5 }, (_, at) =>
      alarm(`a${at}`, { tag_id: `${at}`, cleared: 950 + at }),
    ),
  );
  fireEvent.click(screen.getByText('Resolved in the last 24 h (5)'));
  const heading = screen.getByRole('button', { name: /Temperature too low 5 alarms/ });
  expect(heading.querySelector('.alarm-do')).toBeNull();
  expect(heading.querySelector('[data-fact=since]')?.textContent).toMatch(
    /^resolved sim 00:15:54 /,
  );
  // The empty tools cell stays, to align the columns.
  expect(heading.parentElement?.querySelector('.alarm-tools')?.children).toHaveLength(0);
});

test('a damp spell at a tag is one row with all its values, acknowledged as one, and undone as one', () => {
  const humid = { sensor: 'humidity', verdict: 'stressed', value: 93, limit: 85 } as const;
  const vpd = { sensor: 'vpd', verdict: 'critical', value: 0.04, limit: 0.05 } as const;
  act(() => {
    const read = readings({ humidity: 93, temperature: 20 });
    const judged = judgement({ 4: [reason(vpd), reason(humid)] });
    showTags([wireTag({ tag_id: '4', readings: read })], judged);
  });
  report(
    alarm('rh', { tag_id: '4', raised: 80, reason: humid }),
    alarm('vpd', { tag_id: '4', raised: 85, reason: vpd }),
  );
  const row = document.querySelector<HTMLElement>('.alarm-cause');
  expect(row?.dataset).toMatchObject({ health: 'critical', where: '4' });
  expect(row?.querySelector('[data-fact=since]')?.textContent).toMatch(/^since sim 00:01:20/);
  expect(row?.querySelector('.alarm-text')?.textContent).toMatch(
    /^Tag 4: Air too damp 2 alarms Ventilate and heatVPD 0.04\u00a0kPa \(critical\), Humidity 93.0\u00a0%$/,
  );
  expect(group('active'), 'its values are in the heading').toEqual([]);
  const said = (...more: readonly Alarm[]) => {
    const items = [...alarmList.get().active, ...more.map((it) => ({ ...open, alarm: it }))];
    return severalNow(store.get(), items, S.alarmsRaised);
  };
  const open = { isAcknowledged: false, shelf: null };
  const spell = 'Tag 4: Air too damp: VPD 0.04\u00a0kPa (critical), Humidity 93.0\u00a0%';
  expect(said()).toBe(`New: ${spell}`);
  const others = ['5', '6', '7', '8'].map((tag_id) => alarm(tag_id, { tag_id }));
  expect(said(...others)).toMatch(/; Tag 5: [^;]*; Tag 6: [^;]* and 2 more$/);
  fireEvent.click(screen.getByRole('button', { name: /^Acknowledge: Air too damp/ }));
  expect([...own.get().acknowledged.keys()]).toEqual(['vpd', 'rh']);
  expect(row?.querySelector('.alarm-tools')?.textContent).toBe('acknowledged');
  fireEvent.click(screen.getByRole('button', { name: 'Undo' }));
  expect(own.get().acknowledged.size).toBe(0);
  fireEvent.click(screen.getByRole('button', { name: /2 alarms/ }));
  expect(store.get().view.selected).toBe('4');
  expect(group('active'), 'each to be commented').toHaveLength(2);
  // Shelved as one: one of them is critical, so with a reason and for an hour at most.
  fireEvent.click(screen.getByRole('button', { name: 'Actions: Air too damp' }));
  fireEvent.click(screen.getByRole('button', { name: 'Shelve all (2)' }));
  expect(screen.queryByRole('button', { name: /^For 8/ })).toBeNull();
  const hour = screen.getByRole<HTMLButtonElement>('button', { name: 'For 1\u00a0h' });
  expect(hour.disabled).toBe(true);
  fireEvent.change(screen.getByLabelText('Reason'), { target: { value: 'vents stuck' } });
  fireEvent.click(hour);
  const reasons = () => [...own.get().shelved.values()].map((shelf) => shelf.reason);
  expect(reasons()).toEqual(['vents stuck', 'vents stuck']);
  expect(screen.getByText('2 alarms shelved')).toBeTruthy();
  const shelved = () => document.querySelector('[data-group=shelved] .alarm-cause')?.textContent;
  // Held under the keyboard focus, the heading says so where it stands; then it moves.
  expect(row?.querySelector('.alarm-tools')?.textContent).toMatch(/^shelved until [\d:]+$/);
  fireEvent.blur(screen.getByTestId('alarms'));
  expect(shelved()).toMatch(/shelved until [\d:]+: vents stuck/);
  fireEvent.click(screen.getByRole('button', { name: 'Undo' }));
  expect(reasons()).toEqual([]);
});

test('an alarm’s menu leads to its start', () => {
  report(alarm('a', { tag_id: '5', raised: 1 }));
  fireEvent.click(screen.getByRole('button', { name: /^Actions: Tag 5/ }));
  fireEvent.click(screen.getByRole('button', { name: 'Go to start' }));
  expect(store.get().view).toMatchObject({ moment: 1, selected: '5' });
  expect(document.querySelector('.row-actions')).toBeNull();
});
