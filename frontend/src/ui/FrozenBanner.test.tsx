import { render, screen } from '@testing-library/react';
import { afterEach, beforeEach, expect, test, vi } from 'vitest';

import { epochOf } from '../clock';
import { clockText } from '../domain/format';
import { store } from '../store/app';
import { goLive, goLost, showTags, status } from '../testing/page';
import { wireTag } from '../testing/tags';
import { ConnectionBadge } from './ConnectionBadge';
import { FrozenBanner } from './FrozenBanner';

// The time of the last frame is read from two clocks, which go on between two looks.
beforeEach(() => {
  vi.useFakeTimers({ toFake: ['Date', 'performance'] });
});
afterEach(() => {
  vi.useRealTimers();
});

const text = (): string => screen.getByTestId('frozen').textContent;

test('live data carry no banner', () => {
  showTags([wireTag()]);
  render(<FrozenBanner />);
  expect(screen.queryByTestId('frozen')).toBeNull();
});

test('a lost connection: frozen, since when, and a way to try now', () => {
  showTags([wireTag()]);
  goLost();
  render(<FrozenBanner />);
  const since = clockText(epochOf(store.get().twin.latest.snapshot?.takenAt ?? NaN));
  expect(text()).toContain(`Last data at ${since}`);
  expect(screen.getByRole('button', { name: 'Try now' })).toBeTruthy();
});

test.each([
  ['stale', /stopped publishing/],
  ['never_seen', /has not heard/],
  ['thread_dead', /restarted/],
  ['shutting_down', /shutting down/],
] as const)('twin offline, %s: the reason in words', (reason, words) => {
  showTags([wireTag()]);
  goLive(status({ twin: 'offline', reason }));
  render(<FrozenBanner />);
  expect(text()).toMatch(words);
});

test('each state of the connection has a word of its own', () => {
  showTags([wireTag()]);
  const words = new Set<string>();
  for (const go of [
    goLive,
    goLost,
    () => {
      goLive(status({ twin: 'offline' }));
    },
  ]) {
    go();
    const { unmount } = render(<ConnectionBadge />);
    words.add(screen.getByRole('status').textContent);
    unmount();
  }
  expect(words.size).toBe(3);
});
