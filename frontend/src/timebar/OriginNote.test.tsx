import { act as flush, render, screen } from '@testing-library/react';
import { beforeEach, expect, test } from 'vitest';

import type { StatusFrame } from '../contract/types';
import { act, receive, store } from '../store/app';
import { latestWord, selectOrigin } from '../store/moment';
import { NO_HOUSE, withPast } from '../store/twin';
import { goLive, goLost, showTags, status } from '../testing/page';
import { wireTag } from '../testing/tags';
import { ConnectionBadge } from '../ui/Header';
import { LiveButton, OriginNote, PastFrame } from './Past';

const shows = (origin: StatusFrame['origin'], reason: StatusFrame['reason'] = 'live'): void => {
  flush(() => {
    goLive(status({ origin, reason }));
  });
};
const badge = (): HTMLElement => screen.getByTestId('connection');

beforeEach(() => {
  showTags([wireTag()]);
  render(
    <>
      <OriginNote />
      <ConnectionBadge />
      <PastFrame />
      <LiveButton />
    </>,
  );
});

test('of a robot, or of who does not say, there is nothing to tell', () => {
  for (const origin of ['robot', 'unknown', 'later'] as StatusFrame['origin'][]) {
    shows(origin);
    expect(selectOrigin(store.get())).toBeNull();
    expect(screen.queryByTestId('origin')).toBeNull();
    expect(screen.queryByTestId('recorded-frame')).toBeNull();
    expect(badge().textContent).toBe('Connection: Live');
    expect(badge().dataset['ofNow']).toBe('true');
  }
});

test('a simulation is live, and told at first sight; one by /clock is not green', () => {
  shows('simulated');
  expect(screen.getByTestId('origin').textContent).toMatch(/^SimulatedNo real robot/);
  expect(badge().textContent).toBe('Connection: Live');
  expect(badge().dataset['ofNow']).toBe('true');
  shows('sim_time');
  expect(screen.getByTestId('origin').textContent).toMatch(/^Simulated time/);
  expect(badge().dataset['ofNow']).toBe('false');
  expect(screen.queryByTestId('recorded-frame')).toBeNull();
});

test('while its time is paused, nothing is live', () => {
  shows('simulated', 'paused');
  expect(badge().textContent).toBe('Connection: Paused');
  expect(badge().dataset['ofNow']).toBe('false');
  expect(latestWord()).toBe('Paused');
});

test('what is still shown stays simulated at a bridge that has received nothing yet', () => {
  shows('simulated');
  shows('unknown', 'never_seen');
  expect(screen.getByTestId('origin').textContent).toMatch(/^Simulated/);
  shows('robot');
  expect(screen.queryByTestId('origin')).toBeNull();
});

test('a day of the greenhouse that is a short one is told', () => {
  const day = (day_length_s: number): boolean => {
    flush(() => {
      goLive(status({ origin: 'simulated', day_length_s }));
    });
    return screen.getByTestId('origin').textContent.includes('1 greenhouse day = 24\u00a0min');
  };
  expect(day(86_400)).toBe(false);
  expect(day(1_440)).toBe(true);
});

test('a recording is never live: header, badge, frame and the way back say so, and of when', () => {
  shows('recorded');
  expect(screen.getByTestId('origin').textContent).toMatch(/^Recorded.*nothing here is current/);
  expect(screen.getByTestId('origin').querySelector('strong')?.textContent).toMatch(/^sim 00:01:/);
  expect(badge().textContent).toBe('Connection: Playing');
  expect(badge().dataset['ofNow']).toBe('false');
  expect(screen.getByTestId('recorded-frame').textContent).toMatch(/^Recorded: sim 00:01:/);
  expect(screen.getByRole('button').textContent).toBe('Back to the recording');
  shows('recorded', 'paused');
  expect(badge().textContent).toBe('Connection: Paused');
  expect(document.body.textContent).not.toMatch(/live/i);
  flush(goLost);
  expect(badge().textContent).toBe('Connection: Reconnecting');
});

test('looking back in a recording, the moment is that of the past alone', () => {
  shows('recorded');
  flush(() => {
    receive(withPast({ at: 1, house: NO_HOUSE }));
    act({ moment: 1 });
  });
  expect(screen.queryByTestId('recorded-frame')).toBeNull();
  expect(screen.getByTestId('past-frame').textContent).toBe('');
  expect(screen.getByTestId('origin').querySelector('strong')).toBeNull();
});
