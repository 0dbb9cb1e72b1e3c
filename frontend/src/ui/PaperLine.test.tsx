import { act as flush, render, screen } from '@testing-library/react';
import { afterEach, beforeEach, expect, test, vi } from 'vitest';

import { goLive, showTags, status } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import { PaperLine } from './PaperLine';

beforeEach(() => {
  vi.useFakeTimers({ toFake: ['Date', 'performance'] });
  vi.setSystemTime(new Date(2026, 4, 1, 14, 3, 22));
  showTags([
    wireTag({ readings: readings({ temperature: 20 }) }),
    wireTag({ tag_id: '2', readings: readings({ temperature: 30 }) }),
  ]);
});
afterEach(() => {
  vi.useRealTimers();
});

test('paper has the time of the data and of printing', () => {
  render(<PaperLine />);
  vi.advanceTimersByTime(65_000);
  flush(() => {
    window.dispatchEvent(new Event('beforeprint'));
  });
  const when = 'As of 1 May 2026, 14:03:22, printed 1 May 2026, 14:04:27';
  const line = (): string => screen.getByTestId('paper-line').textContent;
  expect(line()).toBe(when);
  // Data that arrives after printing began is printed, and not dated after the print.
  vi.advanceTimersByTime(3_000);
  flush(() => {
    showTags([wireTag()]);
  });
  expect(line()).toMatch(/^As of 1 May 2026, 14:04:30, printed 1 May 2026, 14:04:30/);
  flush(() => {
    goLive(status({ origin: 'recorded' }));
  });
  // The recording's own time, not when it was played.
  expect(line()).toMatch(/^As of sim \d\d:\d\d:\d\d \(Recorded\), printed 1 May 2026, 14:04:27/);
});
