import { act as flush, fireEvent, render, screen } from '@testing-library/react';
import { afterEach, beforeEach, expect, test, vi } from 'vitest';

import { startTitle } from '../alarms/watch';
import { act, receive, store } from '../store/app';
import { NO_HOUSE, withPast, withState } from '../store/twin';
import { started } from '../testing/life';
import { goLive, showTags, status } from '../testing/page';
import { stateFrame, wireTag } from '../testing/tags';
import { PastFrame, PastHeader } from './Past';

let stop: () => void;

beforeEach(() => {
  vi.spyOn(performance, 'now').mockReturnValue(performance.now());
  showTags([]);
  receive(withState(stateFrame([wireTag()], { sec: 10_000 }), performance.now()));
  stop = started(startTitle);
});
afterEach(() => {
  stop();
});

const look = (at: number | null, came: number | null): void => {
  flush(() => {
    act({ moment: at });
    receive(withPast(came === null ? null : { at: came, house: NO_HOUSE }));
  });
};

test('header, frame and title say the moment of what is shown, not the one that is wanted', () => {
  render(
    <>
      <PastHeader />
      <PastFrame />
    </>,
  );
  const headerState = (): unknown[] => [
    screen.queryByTestId('past-header')?.querySelector('strong')?.textContent ?? null,
    screen.queryByTestId('past-frame') !== null,
    document.title,
  ];
  expect(headerState()).toEqual([null, false, 'Lupin twin']);
  look(2_500, null);
  expect(headerState()).toEqual([null, false, 'Lupin twin']);
  look(2_400, 2_500);
  expect(headerState()).toEqual(['sim 00:41:40', true, 'sim 00:41:40 (past) · Lupin twin']);
  expect(screen.getByTestId('past-header').textContent).toContain('2\u00a0h 5\u00a0min ago');
  fireEvent.click(screen.getByRole('button', { name: 'Back to live' }));
  expect(store.get().view.moment).toBeNull();
  expect(headerState()).toEqual([null, false, 'Lupin twin']);
});

test.each([
  [
    'after a sleep',
    () => {
      receive({ isTimeLost: true });
    },
  ],
  [
    'of a stopped clock',
    () => {
      goLive(status({ twin: 'offline', reason: 'clock_stopped' }));
    },
  ],
  [
    'of an unheard pause',
    () => {
      goLive(status({ reason: 'paused' }), 60_000);
    },
  ],
  [
    'of a clock that went back',
    () => {
      receive(withState(stateFrame([wireTag()], { sec: 2_400 }), performance.now()));
    },
  ],
])('how long ago is not shown without the twin’s time: %s', (_, lose) => {
  look(2_500, 2_500);
  lose();
  render(<PastHeader />);
  expect(screen.getByTestId('past-header').textContent).not.toContain('ago');
});
