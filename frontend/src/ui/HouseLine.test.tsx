import { act, render, screen } from '@testing-library/react';
import { expect, test } from 'vitest';

import type { Judgement } from '../contract/types';
import { snapshotOf } from '../domain/twin';
import { act as view, receive } from '../store/app';
import { NO_HOUSE, withPast, withState } from '../store/twin';
import { judgement, reason } from '../testing/health';
import { goLive, goLost, showTags, status } from '../testing/page';
import { stateFrame, wireTag } from '../testing/tags';
import { HouseLine } from './HealthSummary';

const line = (patrol: Judgement['house']['patrol']): string | undefined => {
  const health = judgement({ '1': 'healthy' }, undefined, patrol);
  showTags([wireTag()], health);
  render(<HouseLine />);
  return screen.queryByTestId('patrol-line')?.textContent;
};

test('shows the scan interval, the last scan and overdue tags', () => {
  // Built states are seconds old, whatever their stamp.
  const lineText = line({ interval_s: 4000, last_scan: 1e-9, overdue: 2 });
  expect(lineText).toMatch(
    /^2 tags overdue · last scan .+ ago · each tag scanned every 1\u00a0h 6\u00a0min$/,
  );
});

test.each([
  [0.1, '0.1\u00a0s'],
  [0.52, '0.5\u00a0s'],
  [7.25, '7.3\u00a0s'],
  [95, '1\u00a0min 35\u00a0s'],
  [600, '10\u00a0min'],
  [43_200, '12\u00a0h'],
])('of %s s between two scans', (interval_s, lineText) => {
  expect(line({ interval_s, last_scan: null, overdue: 0 })).toBe(
    `no tag overdue · no scan yet · each tag scanned every ${lineText}`,
  );
});

test('without a scan interval none is shown', () => {
  expect(line({ interval_s: null, last_scan: null, overdue: 1 })).toBe(
    '1 tag overdue · no scan yet',
  );
});

test('a moment whose scans were deleted is not said to have had none', () => {
  expect(line({ interval_s: null, last_scan: null, overdue: 1 })).toBeDefined();
  const house = { ...NO_HOUSE, snapshot: snapshotOf(stateFrame([wireTag()]), 0, null) };
  act(() => {
    view({ moment: 1 });
    receive(
      withPast({ at: 1, house: { ...house, snapshot: { ...house.snapshot, isWhole: false } } }),
    );
  });
  expect(screen.queryByTestId('patrol-line')).toBeNull();
});

test('nothing is told of readings of which nobody knows when they were', () => {
  const patrol = { interval_s: null, last_scan: null, overdue: 1 };
  const lineText = [{ name: 'temperature', value: 22, observed_at: null }];
  showTags([wireTag({ readings: lineText })], judgement({ '1': 'unknown' }, undefined, patrol));
  render(<HouseLine />);
  expect(screen.queryByTestId('patrol-line')).toBeNull();
});

test('there is none for a greenhouse without tags', () => {
  showTags([], judgement({}));
  render(<HouseLine />);
  expect(screen.queryByTestId('patrol-line')).toBeNull();
});

test('there is none for a silent greenhouse', () => {
  expect(line({ interval_s: 40, last_scan: null, overdue: 0 })).toBeDefined();
  act(goLost);
  expect(screen.queryByTestId('patrol-line')).toBeNull();
});

test.each([
  [
    'after one and a half rounds and a minute',
    1.2,
    61,
    /^No scan for 1\u00a0min \(usually each tag is scanned every 1.2\u00a0s\) · Check the robot$/,
  ],
  ['not within a minute', 1.2, 59, /^no tag overdue/],
  ['not while it rests between two rounds', 1200, 1200, /^no tag overdue/],
])('who drives no more is looked after: %s', (_, interval_s, late, lineText) => {
  const health = judgement({ '1': 'healthy' }, undefined, {
    ...{ interval_s, last_scan: 1, overdue: 0 },
  });
  const latest = stateFrame([wireTag()], { sec: 1 + late, health });
  const show = (bridge = status()): string => {
    act(() => {
      receive(withState(latest, performance.now()));
      goLive(bridge);
    });
    return screen.getByTestId('patrol-line').textContent;
  };
  showTags([wireTag()]);
  render(<HouseLine />);
  expect(show()).toMatch(lineText);
  // The clock is paused, for an unknown time.
  expect(show(status({ reason: 'paused' }))).toMatch(/^no tag overdue/);
  const then = { ...NO_HOUSE, snapshot: snapshotOf(latest, 0, null), health };
  act(() => {
    goLive();
    view({ moment: 1 + late });
    receive(withPast({ at: 1 + late, house: then }));
  });
  expect(screen.getByTestId('patrol-line').textContent).toMatch(/^no tag overdue/);
});

test('if the greenhouse has its own reason, that says what to do', () => {
  const patrol = { interval_s: 1.2, last_scan: 1, overdue: 0 };
  const { house, tags } = judgement({ '1': 'healthy' }, undefined, patrol);
  const health = { house: { ...house, reasons: [reason({ kind: 'stopped' })] }, tags };
  const latest = stateFrame([wireTag()], { sec: 601, health });
  showTags([wireTag()]);
  act(() => {
    receive(withState(latest, performance.now()));
  });
  render(<HouseLine />);
  expect(screen.getByTestId('patrol-line').textContent).toMatch(/^No scan for .+\)$/);
});
