import { render } from '@testing-library/react';
import { expect, test, vi } from 'vitest';

import { CATALOGUE } from '../testing/sensors';
import { alarm } from '../testing/alarms';
import Alarms from './Alarms';
import { useAnswer } from './useAnswer';
import type { Site } from './sites';

vi.mock('./useAnswer', async (original) => ({
  ...(await original<object>()),
  useAnswer: vi.fn(),
  useSensors: () => CATALOGUE,
}));

const at = (sec: number): number => sec;
const read = (value: number, sec: number) => ({
  ...{ value, verdict: 'critical', reason: null, observed_at: at(sec) },
});

function textOf(over: object): string | null {
  const shown = {
    ...{ ...alarm('a', { worst: 4 }), site: 'gh1', name: 'One', is_live: true },
    ...{ now: read(8, 4_000), hour_s: 3_600, ...over },
  };
  vi.mocked(useAnswer).mockReturnValue({ value: { alarms: [shown] }, message: null } as never);
  const site = { site: 'gh1', active_alarms: 1 } as Site;
  const { container, unmount } = render(<Alarms shown={[site]} />);
  const { textContent } = container;
  unmount();
  return textContent;
}

test('a value now has its trend, as on the page of its greenhouse', () => {
  expect(textOf({ hour_ago: read(11, 400) })).toContain('now 8.0\u00a0°C \u2198 −3.0');
  // A demo has short days.
  expect(textOf({ hour_ago: read(11, 400), hour_s: 60 })).toMatch(/\(1\smin\)/);
  for (const none of [null, undefined, read(8, 4_000)]) {
    expect(textOf({ hour_ago: none })).not.toMatch(/[\u2197\u2198\u2192]/);
  }
  expect(textOf({ hour_ago: read(11, 400), is_live: false })).not.toContain('\u2198');
});
