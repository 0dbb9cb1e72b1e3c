import { act as flush, render } from '@testing-library/react';
import { expect, test } from 'vitest';

import { startAlarms } from '../../alarms/watch';
import { receive } from '../../store/app';
import { alarm, reportAlarms } from '../../testing/alarms';
import { goLost, showTags } from '../../testing/page';
import { readings, wireTag } from '../../testing/tags';
import { AlarmPanel } from './AlarmPanel';

test('how old the last value is nobody knows after a sleep', () => {
  showTags([wireTag({ readings: readings({ temperature: 8 }) })]);
  const stop = startAlarms();
  render(<AlarmPanel />);
  flush(() => {
    reportAlarms(alarm('a'));
    goLost();
  });
  const now = (): string | undefined => document.querySelector('[data-fact=now]')?.textContent;
  expect(now()).toMatch(/^now unknown, last 8.0\u00a0°C .+ ago$/);
  flush(() => {
    receive({ isTimeLost: true });
  });
  expect(now()).toBe('now unknown, last 8.0\u00a0°C');
  stop();
});
