import { act as flush, fireEvent, render, screen, within } from '@testing-library/react';
import { beforeEach, expect, test, vi } from 'vitest';

import { acknowledge, lastAction, NO_LOCAL_ALARMS, own, shelveAlarms } from '../../alarms/own';
import { startAlarms } from '../../alarms/watch';
import { notifyState } from '../../alarms/notify';
import type { Alarm, HealthReason } from '../../contract/types';
import { act as dispatch, receive, store } from '../../store/app';
import { person } from '../../store/create';
import { NO_HOUSE, withPast } from '../../store/twin';
import { started } from '../../testing/life';
import { alarm, alarms, reportAlarms } from '../../testing/alarms';
import { goLost, showTags } from '../../testing/page';
import { judgement, reason } from '../../testing/health';
import { readings, wireTag } from '../../testing/tags';
import { AlarmPanel } from './AlarmPanel';

beforeEach(() => {
  own.set(NO_LOCAL_ALARMS);
  lastAction.set(null);
  person.set(null);
  showTags([wireTag()]);
  const stop = started(startAlarms);
  render(<AlarmPanel />);
  return stop;
});

const report = (...list: readonly Alarm[]): void => {
  flush(() => {
    reportAlarms(...list);
  });
};
const group = (name: string): HTMLElement[] => [
  ...document.querySelectorAll<HTMLElement>(`[data-group=${name}] [data-alarm]`),
];
const first = (name: string): HTMLElement => {
  const [row] = group(name);
  if (!row) throw new Error(`no row in ${name}`);
  return row;
};
/** Text in the place of a row's acknowledge button. */
const status = (tag: string): string | null | undefined =>
  document.querySelector(`[data-where='${tag}'] > .alarm-tools > :first-child`)?.textContent;
const fact = (row: HTMLElement, name: string): HTMLElement => {
  const found = row.querySelector<HTMLElement>(`[data-fact=${name}]`);
  if (!found) throw new Error(`nothing of ${name}`);
  return found;
};
const notes = (): (string | undefined)[] =>
  [...document.querySelectorAll<HTMLElement>('[data-note]')].map(({ dataset }) => dataset['note']);
const press = (name: RegExp | string): void => {
  fireEvent.click(screen.getByRole('button', { name }));
};
/** Entries in the menu of a tag's row. */
const actions = (tag: string): (string | null)[] => {
  press(new RegExp(`^Actions: Tag ${tag}`));
  return [...document.querySelectorAll('.row-actions button')].map((each) => each.textContent);
};
const act = (tag: string, name: string): void => {
  actions(tag);
  press(name);
};

test('each in words: for how long, what, where, now, at worst; what is resolved when asked for', () => {
  report(
    alarm('a', { tag_id: '5', raised: 80, worst: 4.2 }),
    alarm('b', { tag_id: '', raised: 100, cleared: 160, reason: { kind: 'stopped', sensor: '' } }),
  );
  const active = first('active');
  expect(active.textContent).toContain('Tag 5: Temperature below 10.0\u00a0°C');
  expect(fact(active, 'since').textContent).toMatch(
    /^since sim 00:01:20 \(\d+\u00a0\w+\) Critical$/,
  );
  expect(fact(active, 'since').title).toContain('6.6\u00a0°C when raised');
  expect(fact(active, 'worst').textContent).toContain('worst 4.2\u00a0°C');
  expect(fact(active, 'worst').dataset['status']).toBe('critical');
  expect(fact(active, 'now').textContent).toBe('now unknown');
  expect(group('resolved')).toEqual([]);
  press('Resolved in the last 24 h (1)');
  const resolved = first('resolved');
  expect(resolved.textContent).toContain('Whole greenhouse: No tag is being scanned');
  expect(fact(resolved, 'since').textContent).toMatch(/^resolved sim 00:02:40 \(1\u00a0min\)/);
  expect(fact(resolved, 'since').title).toContain('sim 00:01:40 until sim 00:02:40 (1\u00a0min)');
  press(/^Actions: Whole greenhouse/);
  expect(within(resolved).queryByRole('button', { name: 'Shelve' })).toBeNull();
});

test('the value of now follows the newest state, with its own severity', () => {
  const see = (value: number, ...reasons: readonly HealthReason[]): void => {
    flush(() => {
      showTags(
        [wireTag({ readings: readings({ temperature: value }) })],
        judgement({ '1': reasons }),
      );
      reportAlarms(alarm('a', { worst: 4.2 }));
    });
  };
  see(8.1, reason({ value: 8.1 }));
  expect(fact(first('active'), 'now').textContent).toContain('now 8.1\u00a0°C');
  see(12.3, reason({ value: 12.3, limit: 18, verdict: 'stressed' }));
  const now = fact(first('active'), 'now');
  expect([now.textContent, now.dataset['status']]).toEqual([' now 12.3\u00a0°C', 'stressed']);
  expect(fact(first('active'), 'worst').dataset['status']).toBe('critical');
  // A lost connection makes nothing worse.
  flush(goLost);
  expect(fact(first('active'), 'since').textContent).toContain('Stressed');
});

test('what is worse now than the alarm has said yet has its severity, and no worst beside it', () => {
  flush(() => {
    const tag = wireTag({ readings: readings({ temperature: 8.1 }) });
    showTags([tag], judgement({ 1: [reason({ value: 8.1 })] }));
  });
  report(alarm('a', { worst: 12, reason: { value: 12, limit: 18, verdict: 'stressed' } }));
  const now = fact(first('active'), 'now');
  expect([now.title, now.dataset['status']]).toEqual(['now 8.1\u00a0°C', 'critical']);
  expect(first('active').textContent).not.toContain('worst');
});

test('what is well again waits for one more good scan, and pests for an inspection', () => {
  flush(() => {
    const warm = { readings: readings({ temperature: 22 }) };
    const tags = ['5', '6'].map((tag_id) => wireTag({ tag_id, ...warm }));
    showTags(tags, judgement({ 5: 'healthy', 6: 'healthy' }));
  });
  const pest = { kind: 'pest', sensor: '', value: 2, limit: null } as const;
  report(alarm('a', { tag_id: '5' }), alarm('b', { tag_id: '6', reason: pest }));
  const todo = (tag: string): string | null | undefined =>
    document.querySelector(`[data-where='${tag}'] .alarm-do`)?.textContent;
  expect([todo('5'), todo('6')]).toEqual([
    'The next good scan resolves it',
    'Inspect again to resolve it',
  ]);
  // An active alarm is never called healthy, nor dated as if that were since then.
  expect(fact(first('active'), 'since').textContent).toMatch(/^alarm since .*Back to normal$/);
});

test('who acknowledged it and when, by the clock of the twin', () => {
  const said = { acknowledged_by: 'anna', acknowledged_at: 1_000 };
  report(alarm('a', { tag_id: '5', ...said }));
  flush(() => {
    own.set(acknowledge(NO_LOCAL_ALARMS, [{ alarm: alarm('a') }], 0));
  });
  expect(status('5')).toBe('acknowledged by anna, sim 00:16:40');
});

test('who may not act on what is shared is offered nothing of it', () => {
  const session = { can_sign_out: true, seconds_left: null, role: 'viewer' } as const;
  report(alarm('a', { tag_id: '5' }), alarm('b', { tag_id: '6' }));
  expect(screen.getAllByRole('button', { name: /^Acknowledge/ })).toHaveLength(3);
  flush(() => {
    person.set({ ...session, name: 'vera', can_write_notes: false });
  });
  expect(screen.queryAllByRole('button', { name: /acknowledge/i })).toEqual([]);
  expect(actions('5')).toEqual(['Go to start']);
  fireEvent.keyDown(document, { key: 'Escape' });
  flush(() => {
    person.set({ ...session, name: 'anna', role: 'operator', can_write_notes: true });
    goLost();
  });
  expect(actions('6')).toEqual(['Go to start', 'Shelve', 'Comment']);
  expect(document.querySelector('.acknowledge-all:enabled')).toBeNull();
  expect(document.querySelectorAll('.alarm-tools li :enabled')).toHaveLength(1);
});

test('acknowledged, shelved, and back', () => {
  report(alarm('a', { tag_id: '5' }), alarm('b', { tag_id: '6', reason: { verdict: 'stressed' } }));
  const acknowledged = (): (string | undefined)[] =>
    group('active').map(({ dataset }) => dataset['acknowledged']);
  press(/^Acknowledge: Tag 5/);
  expect(acknowledged()).toEqual(['true', 'false']);
  expect([status('5'), status('6')]).toEqual(['acknowledged', 'Acknowledge']);
  // The status in the button's place does nothing when pressed.
  press('acknowledged');
  expect(acknowledged()).toEqual(['true', 'false']);
  press('Undo');
  expect(acknowledged()).toEqual(['false', 'false']);
  press(/^Acknowledge: Tag 5/);
  act('5', 'Unacknowledge');
  expect(acknowledged()).toEqual(['false', 'false']);
  act('6', 'Shelve');
  press('For 8\u00a0h');
  expect(group('active')).toHaveLength(1);
  expect(group('shelved')[0]?.textContent).toMatch(/shelved until \d\d:\d\d/);
  act('6', 'Unshelve');
  expect(group('active')).toHaveLength(2);
  press('Acknowledge all (2)');
  expect(group('active').map(({ dataset }) => dataset['acknowledged'])).toEqual(['true', 'true']);
  const all = screen.getByRole<HTMLButtonElement>('button', { name: 'Acknowledge all (0)' });
  expect(all.disabled).toBe(true);
});

test('a critical alarm takes a reason, and is shelved for no more than an hour', () => {
  report(alarm('a', { tag_id: '5' }));
  act('5', 'Shelve');
  expect(screen.getByText(/^Shelve: Tag 5: Temperature below 10.0.°C$/)).toBeTruthy();
  const times = screen.getAllByRole<HTMLButtonElement>('button', { name: /^For (15.min|1.h)$/ });
  expect(times.map(({ disabled }) => disabled)).toEqual([true, true]);
  const reason = screen.getByLabelText('Reason');
  expect(document.activeElement).toBe(reason);
  fireEvent.change(reason, { target: { value: ' fan is being mended ' } });
  press('For 1\u00a0h');
  // No row moves while the focus is in the list.
  fireEvent.blur(screen.getByTestId('alarms'));
  expect(first('shelved').textContent).toMatch(/shelved until [\d:]+: fan is being mended/);
  // A shelved alarm shows no action.
  expect(document.querySelector('.alarm-do')).toBeNull();
  report(alarm('a', { tag_id: '5', shelved_by: 'anna' }));
  expect(first('shelved').textContent).toMatch(/shelved by anna until [\d:]+: fan is being mended/);
});

test('what is shelved while the list is held says so where it stands, and all is without it', () => {
  fireEvent.pointerEnter(screen.getByTestId('alarms'));
  const mild = { verdict: 'stressed' } as const;
  report(alarm('a', { tag_id: '5', reason: mild }), alarm('b', { tag_id: '6', reason: mild }));
  act('5', 'Shelve');
  fireEvent.change(screen.getByLabelText(/^Reason/), { target: { value: 'fan' } });
  press('For 1\u00a0h');
  expect(status('5')).toMatch(/^shelved until \d\d:\d\d$/);
  // The reason replaces the action, as a quotation.
  expect(first('active').querySelector('.alarm-do')).toBeNull();
  expect(first('active').querySelector('q')?.textContent).toBe('fan');
  expect(group('active').map(({ textContent }) => textContent.includes('shelved until'))).toEqual([
    true,
    false,
  ]);
  const text = first('active').querySelector('.alarm-text');
  expect(text?.textContent).not.toContain('shelved until');
  // The heading no longer counts it.
  expect(group('active').map(({ dataset }) => dataset['elsewhere'])).toEqual(['true', 'false']);
  press('Acknowledge all (1)');
});

test('what is resolved while the list is held says so where it stands, and no count has it', () => {
  const bad = Array.from({ length: 5 }, (_, at) => alarm(`a${at}`, { tag_id: String(at) }));
  report(...bad);
  const list = screen.getByTestId('alarms');
  fireEvent.click(screen.getByText(/5 alarms/));
  fireEvent.pointerEnter(list);
  report(...bad.slice(1), alarm('a0', { tag_id: '0', cleared: 950 }));
  expect(status('0')).toBe('resolved');
  expect(group('active')).toHaveLength(5);
  for (const row of group('active')) expect(fact(row, 'since').textContent).not.toMatch(/resolved/);
  expect(screen.getAllByRole('heading')[0]?.textContent).toBe('Active (4)');
  expect(screen.getByText(/4 alarms/)).toBeTruthy();
  expect(screen.getAllByText('Acknowledge all (4)')).toHaveLength(2);
  fireEvent.change(screen.getByLabelText('Filter alarms'), { target: { value: 'temperature' } });
  expect(screen.getAllByRole('heading')[0]?.textContent).toBe('Active (4/4)');
  press('Acknowledge all (4)');
  expect(own.get().acknowledged.has('a0')).toBe(false);
});

test('what is worst now stands first, whatever was worse once', () => {
  const tags = ['5', '6'].map((tag_id) =>
    wireTag({ tag_id, readings: readings({ temperature: 12 }) }),
  );
  const mild = reason({ value: 12, limit: 18, verdict: 'stressed' });
  report(
    alarm('was', { tag_id: '5' }),
    alarm('is', { tag_id: '6', reason: { verdict: 'stressed' } }),
  );
  const judged = (five: HealthReason, six: HealthReason): (string | undefined)[] => {
    flush(() => {
      showTags(tags, judgement({ 5: [five], 6: [six] }));
    });
    return group('active').map(({ dataset }) => dataset['alarm']);
  };
  expect(judged(mild, reason({ value: 8 }))).toEqual(['is', 'was']);
  expect(judged(mild, mild)).toEqual(['was', 'is']);
});

test('while the pointer is in the list no row moves, and what is new is counted above it', () => {
  const ids = (): (string | undefined)[] => group('active').map(({ dataset }) => dataset['alarm']);
  const list = screen.getByTestId('alarms');
  const a = alarm('a', { reason: { verdict: 'stressed' } });
  // An empty list has nothing to hold.
  fireEvent.pointerEnter(list);
  report(a);
  expect(ids()).toEqual(['a']);
  report(a, alarm('worse', { tag_id: '2' }));
  expect(ids()).toEqual(['a']);
  expect(screen.getByRole('heading').textContent).toBe('Active (2)');
  expect(screen.getByTestId('alarm-line').textContent).toBe('1 new');
  press('1 new');
  expect(ids()).toEqual(['worse', 'a']);
  expect(screen.getByTestId('alarm-line').textContent).toBe('');
  report(a);
  expect(ids()).toEqual(['worse', 'a']);
  fireEvent.pointerLeave(list);
  expect(ids()).toEqual(['a']);
});

test('a row leads to its tag', () => {
  report(alarm('a', { tag_id: '5' }));
  fireEvent.click(within(first('active')).getByText(/Temperature/));
  expect(store.get().view.selected).toBe('5');
});

test('without an alarm it says so; where that is not known it says that', () => {
  expect(notes()).toEqual(['unknown']);
  flush(() => {
    receive({ alarms: alarms([], { source: 'starting', since: null }) });
  });
  expect(notes()).toEqual(['starting', 'unknown']);
  report();
  expect(notes()).toEqual(['none']);
  expect(screen.getByText('No alarm is active')).toBeTruthy();
  flush(() => {
    showTags([wireTag()], judgement({ 1: [reason({ kind: 'pest', sensor: '' })] }));
  });
  report();
  expect(notes()).toEqual(['none']);
  flush(() => {
    showTags([wireTag()], judgement({ 1: [reason()] }));
  });
  report();
  const wait = '1 tag waiting for a second scan: no alarm yet';
  expect(notes()).toEqual(['none', 'wait']);
  expect(screen.getByText(wait)).toBeTruthy();
  // Also shown beside another tag's alarm, but not beside its own.
  report(alarm('a', { tag_id: '5' }));
  // Below the rows, so that they do not move.
  expect(screen.getByText(wait).previousElementSibling).toBe(first('active').closest('section'));
  const ofTag = alarm('a', { tag_id: '1' });
  report(ofTag);
  expect(screen.queryByText(wait)).toBeNull();
  flush(() => {
    shelveAlarms([{ alarm: ofTag }], 15, 'fan');
  });
  expect(group('shelved')).toHaveLength(1);
  expect(screen.queryByText(wait)).toBeNull();
  flush(() => {
    receive({ alarms: alarms([], { source: 'heard' }) });
  });
  expect(notes()).toEqual(['none', 'wait', 'heard']);
  report();
  flush(goLost);
  expect(notes()).toEqual(['lost']);
});

test('it is of now, and says so while another moment is shown', () => {
  report(alarm('a'));
  expect(notes()).toEqual([]);
  flush(() => {
    dispatch({ moment: 50 });
    receive(withPast({ at: 50, house: NO_HOUSE }));
  });
  expect(notes()).toEqual(['now']);
  expect(screen.getByText(/current alarms.*sim 00:00:50/)).toBeTruthy();
  expect(group('active')).toHaveLength(1);
});

test('many of one cause are one heading, which is acknowledged as one and names the worst', () => {
  const bad = Array.from({ length: 5 }, (_, at) => alarm(`a${at}`, { tag_id: String(at) }));
  report(...bad, alarm('b', { tag_id: '9', reason: { sensor: 'humidity', verdict: 'stressed' } }));
  expect(group('active'), 'the other alarm').toHaveLength(1);
  const heading = screen.getByRole('button', { name: /Critical\s*Temperature too low/ });
  expect(heading.textContent).toContain('5 alarms');
  expect(heading.textContent).toContain('Tags 0, 1, 2, 3, 4');
  expect(heading.getAttribute('aria-expanded')).toBe('false');
  press('Acknowledge: Temperature too low');
  fireEvent.click(heading);
  expect(heading.getAttribute('aria-expanded')).toBe('true');
  expect(group('active').map(({ dataset }) => dataset['acknowledged'])).toEqual([
    ...Array<string>(5).fill('true'),
    'false',
  ]);
  press('Undo');
  expect(first('active').dataset['acknowledged']).toBe('false');
});

test('Escape empties the filter first, and only then what lies over the map', () => {
  const filter = screen.getByLabelText<HTMLInputElement>('Filter alarms');
  fireEvent.change(filter, { target: { value: 'tag 6' } });
  expect(fireEvent.keyDown(filter, { key: 'Escape' })).toBe(false);
  expect(filter.value).toBe('');
  expect(fireEvent.keyDown(filter, { key: 'Escape' })).toBe(true);
});

test('what is filtered away is not acknowledged with all', () => {
  report(alarm('a', { tag_id: '5' }), alarm('b', { tag_id: '6' }));
  fireEvent.change(screen.getByLabelText('Filter alarms'), { target: { value: 'tag 6' } });
  expect(group('active').map(({ dataset }) => dataset['where'])).toEqual(['6']);
  expect(screen.getByRole('heading').textContent).toBe('Active (1/2)');
  press('Acknowledge all (1)');
  fireEvent.change(screen.getByLabelText('Filter alarms'), { target: { value: '' } });
  expect(group('active').map(({ dataset }) => dataset['acknowledged'])).toEqual(['false', 'true']);
  fireEvent.change(screen.getByLabelText('Filter alarms'), { target: { value: 'humidity' } });
  expect(screen.getByTestId('alarms').textContent).toMatch(/matches the filter\.Active \(0\/2\)/);
});

test('nothing makes itself heard unless it is wished, and what cannot says why', () => {
  vi.stubGlobal('isSecureContext', false);
  notifyState.set('insecure');
  press('Notify me of alarms');
  const [sound, notify] = screen.getAllByRole<HTMLInputElement>('checkbox');
  expect([sound?.checked, notify?.checked, notify?.disabled]).toEqual([false, false, true]);
  expect(screen.getByText(/https:\/\/ or http:\/\/localhost/)).toBeTruthy();
});
