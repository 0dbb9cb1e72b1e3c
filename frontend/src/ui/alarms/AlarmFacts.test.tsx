import { act as flush, fireEvent, render, screen } from '@testing-library/react';
import { expect, onTestFinished, test } from 'vitest';

import { startAlarms } from '../../alarms/watch';
import { receive } from '../../store/app';
import { person } from '../../store/create';
import { started } from '../../testing/life';
import { alarm, alarms, reportAlarms } from '../../testing/alarms';
import { judgement } from '../../testing/health';
import { goLive, goLost, showTags, status } from '../../testing/page';
import { readings, wireTag } from '../../testing/tags';
import { AlarmPanel } from './AlarmPanel';

test('how old the last value is nobody knows after a sleep', () => {
  showTags([wireTag({ readings: readings({ temperature: 8 }) })]);
  onTestFinished(started(startAlarms));
  render(<AlarmPanel />);
  flush(() => {
    reportAlarms(alarm('a'));
    goLost();
  });
  const now = (): string | undefined =>
    document.querySelector<HTMLElement>('[data-fact=now]')?.title;
  expect(now()).toMatch(/^now unknown, last 8.0\u00a0°C .+ ago$/);
  flush(() => {
    receive({ isTimeLost: true });
  });
  expect(now()).toBe('now unknown, last 8.0\u00a0°C');
});

test('a silent twin’s values are neither back to normal nor ask for anything, and move no row', () => {
  showTags([wireTag({ readings: readings({ temperature: 20 }) })], judgement({ 1: 'healthy' }));
  onTestFinished(started(startAlarms));
  const { container } = render(<AlarmPanel />);
  flush(() => {
    reportAlarms(alarm('a'));
  });
  const row = (): string | undefined => container.querySelector('[data-alarm]')?.textContent;
  const todo = (): string | undefined => {
    const line = container.querySelector('.alarm-do');
    return line ? getComputedStyle(line).visibility : undefined;
  };
  expect(row()).toContain('Back to normal');
  expect(todo()).toBe('visible');
  flush(goLost);
  expect(row()).toContain('Unknown');
  expect(row()).not.toContain('Back to normal');
  expect(todo()).toBe('hidden');
  // What to do about the silence itself stays.
  flush(() => {
    reportAlarms(alarm('s', { tag_id: '', reason: { kind: 'silent', sensor: '', value: null } }));
  });
  expect(row()).toContain('Check the twin');
  expect(todo()).toBe('visible');
});

test('the field for a comment names its alarm', () => {
  showTags([wireTag()]);
  person.set({
    ...{ name: 'anna', role: 'operator', can_write_notes: true },
    ...{ can_sign_out: true, seconds_left: null },
  });
  onTestFinished(started(startAlarms));
  render(<AlarmPanel />);
  flush(() => {
    reportAlarms(alarm('a'));
  });
  fireEvent.click(screen.getByRole('button', { name: /^Actions/ }));
  fireEvent.click(screen.getByRole('button', { name: 'Comment' }));
  expect(screen.getByLabelText(/^Comment: Tag 1: Temperature below/)).toBeTruthy();
  person.set(null);
});

test('without a valid time nothing is being read, and what to do is as in the banner', () => {
  showTags([wireTag()]);
  onTestFinished(started(startAlarms));
  const { container } = render(<AlarmPanel />);
  const notes = (): string[] =>
    [...container.querySelectorAll<HTMLElement>('[data-note]')].map((it) => it.textContent);
  flush(() => {
    receive({ alarms: alarms([], { source: 'starting', since: null }) });
    goLive(status({ twin: 'offline', reason: 'clock_stopped' }));
  });
  expect(notes()).toEqual(['While the time is unknown, alarms may be missing.']);
  flush(() => {
    reportAlarms(alarm('s', { tag_id: '', reason: { kind: 'silent', sensor: '', value: null } }));
  });
  expect(notes()).toHaveLength(1);
  const row = container.querySelector('[data-alarm]')?.textContent;
  expect(row).toContain('Check the simulation');
  expect(row).not.toContain('network');
});
