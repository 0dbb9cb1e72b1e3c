import { act as flush, render } from '@testing-library/react';
import { afterEach, beforeEach, expect, test } from 'vitest';

import { startAlarms } from '../../alarms/watch';
import { receive } from '../../store/app';
import { alarm, tellAlarms } from '../../testing/alarms';
import { goLive, goLost, showTags, status } from '../../testing/page';
import { readings, wireTag } from '../../testing/tags';
import { AlarmPanel } from './AlarmPanel';

let stop: () => void;

beforeEach(() => {
  showTags([wireTag({ readings: readings({ temperature: 8 }) })]);
  stop = startAlarms();
  render(<AlarmPanel />);
});
afterEach(() => {
  stop();
});

const notes = (): (string | undefined)[] =>
  [...document.querySelectorAll<HTMLElement>('[data-note]')].map(({ dataset }) => dataset['note']);

test('that no alarm is active is not told of a twin without a time, which raises none', () => {
  flush(() => {
    tellAlarms();
  });
  expect(notes()).toEqual(['none']);
  for (const reason of ['no_clock', 'clock_stopped', 'clock_doubted'] as const) {
    flush(() => {
      goLive(status({ twin: 'offline', reason }));
    });
    expect(notes()).toEqual(['lost']);
  }
  // Its own silence is an alarm, which the bridge tells.
  flush(() => {
    goLive(status({ twin: 'offline', reason: 'stale' }));
  });
  expect(notes()).toEqual(['none']);
});

test('how old the last value is nobody knows after a sleep', () => {
  flush(() => {
    tellAlarms(alarm('a'));
    goLost();
  });
  const now = (): string | undefined => document.querySelector('[data-fact=now]')?.textContent;
  expect(now()).toMatch(/^now unknown, last 8.0\u00a0°C .+ ago$/);
  flush(() => {
    receive({ type: 'lapse' });
  });
  expect(now()).toBe('now unknown, last 8.0\u00a0°C');
});
