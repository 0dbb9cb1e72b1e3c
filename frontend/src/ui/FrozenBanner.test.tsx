import { render, screen } from '@testing-library/react';
import { afterEach, beforeEach, expect, test, vi } from 'vitest';

import { epochOf } from '../clock';
import { clockText } from '../domain/format';
import { dateText } from '../domain/time';
import { act, receive, store } from '../store/app';
import { NO_HOUSE, withPast } from '../store/twin';
import { goLive, goLost, showTags, status } from '../testing/page';
import { wireTag } from '../testing/tags';
import { ConnectionBadge } from './Header';
import { FrozenBanner, Troubles } from './Troubles';

// The last frame's time is read from two clocks, which would advance between the reads.
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

test('a lost connection: since when, why, and a way to try now, in two lines of a phone', () => {
  showTags([wireTag()]);
  goLost();
  render(<FrozenBanner />);
  const since = clockText(epochOf(store.get().twin.latest.snapshot?.takenAt ?? NaN));
  expect(text()).toBe(`Last data at ${since}0\u00a0s agoConnection to the server lost.Try now`);
  expect(screen.getByRole('button', { name: 'Try now' })).toBeTruthy();
});

test.each([
  ['stale', /stopped sending/, /published on \/twin\/state/],
  ['never_seen', /has received nothing/, /same ROS domain/],
  ['thread_dead', /restarted/, /ROS thread/],
  ['shutting_down', /shutting down/, null],
] as const)('twin offline, %s: the reason in words, the machines behind', (reason, words, more) => {
  showTags([wireTag()]);
  goLive(status({ twin: 'offline', reason }));
  render(<FrozenBanner />);
  expect(text()).toMatch(words);
  const details = document.querySelector('details.more');
  if (more) expect(details?.textContent).toMatch(more);
  else expect(details).toBeNull();
});

test.each([
  ['no_clock', 'Start the simulation or the recording.', /age of the readings is unknown/],
  ['clock_stopped', 'Check the simulation or the recording.', /age of the readings is unknown/],
  ['clock_doubted', 'Set the twin’s clock.', /ages are unknown and nothing is recorded/],
] as const)(
  'data without a valid time are not dated, and what to do comes first: %s',
  (reason, todo, why) => {
    showTags([wireTag()]);
    const detail = 'the clock contradicts the journal, written until 2026-11-30T18:45:24Z';
    const journal = { ...status().journal, state: 'doubting', detail } as const;
    goLive(status({ twin: 'offline', reason, journal }));
    render(
      <>
        <FrozenBanner />
        <Troubles />
        <ConnectionBadge />
      </>,
    );
    expect(screen.getByRole('alert').querySelector('strong')?.textContent.trim()).toBe(todo);
    expect(text()).toMatch(why);
    expect(text()).not.toMatch(/Last data|ago|18:45:24Z/);
    expect(screen.getByTestId('troubles').textContent).toBe('');
    // Data arrives: the twin is not offline.
    expect(screen.getByTestId('connection').textContent).toBe('Connection: Time unknown');
    const more = document.querySelector('details.more')?.textContent;
    const until = dateText(Date.UTC(2026, 10, 30, 18, 45, 24));
    expect(more).toContain(reason === 'clock_doubted' ? `until ${until}.` : '/clock');
  },
);

test('the clock of a fleet’s greenhouse may be ahead, while its recording goes on', () => {
  showTags([wireTag()]);
  goLive(status({ twin: 'offline', reason: 'clock_doubted' }));
  render(<FrozenBanner />);
  expect(text()).toMatch(/Set the twin’s clock. It is ahead of the archive’s clock/);
  expect(text()).not.toContain('recording');
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

test('behind a look back: live data have stopped, and what is shown stays', () => {
  showTags([wireTag()]);
  receive(withPast({ at: 50, house: NO_HOUSE }));
  act({ moment: 50 });
  goLost();
  render(
    <>
      <FrozenBanner />
      <ConnectionBadge />
    </>,
  );
  expect(text()).toContain('Live data has stopped.');
  expect(text()).toContain('The past shown is not affected.');
  expect(text()).not.toContain('frozen');
  expect(screen.getByTestId('connection').textContent).toContain('Past · Reconnecting');
});

test('nothing says “Live” while another moment is shown', () => {
  showTags([wireTag()]);
  receive(withPast({ at: 50, house: NO_HOUSE }));
  act({ moment: 50 });
  render(<ConnectionBadge />);
  expect(screen.getByTestId('connection').textContent).toBe('Connection: Past');
});
