import { afterEach, beforeEach, expect, test } from 'vitest';

import { timelineOf } from '../domain/timeline';
import { started } from '../testing/life';
import { wireTimeline } from '../testing/timeline';
import { act, receive, store } from './app';
import { startOpening } from './remembered';
import { fromFragment, toFragment } from './address';
import { NOTHING } from './fetcher';
import { DEFAULT_VIEW } from './view';

const NOW = 1_000_000;
const SHORT_S = 10_800;

let stop: () => void;

const remember = (seconds: number | null): void => {
  const reach = seconds === null ? null : { from: NOW - seconds, to: NOW };
  const value = timelineOf(wireTimeline({ from: NOW - 86_400, to: NOW, reach }), NOW);
  receive({ remembered: { value, state: 'ready', message: '' } });
};
const follow = (fragment: string): void => {
  act(fromFragment(fragment));
};
const period = (): unknown => store.get().view.period;
const address = (): string => toFragment(store.get().view);

beforeEach(() => {
  receive({ remembered: NOTHING });
  act(DEFAULT_VIEW);
  stop = started(startOpening);
});
afterEach(() => {
  stop();
});

test('the page opens on the last hour where memory is short, and its link does not say so', () => {
  remember(null);
  expect(period()).toEqual({ kind: 'day' });
  remember(SHORT_S - 1);
  expect(period()).toEqual({ kind: 'hour' });
  expect(address()).toBe('');
});

test('on the last day where memory is not short; and stays so', () => {
  remember(SHORT_S);
  expect(period()).toEqual({ kind: 'day' });
  remember(60);
  expect(period()).toEqual({ kind: 'day' });
});

test('what a link says, it is', () => {
  follow('period=day');
  remember(60);
  expect(period()).toEqual({ kind: 'day' });
  expect(address()).toBe('period=day');
  follow('');
  expect(period()).toEqual({ kind: 'hour' });
});

test('what a person chose stays, and is in the link', () => {
  remember(60);
  act({ period: { kind: 'day' } });
  remember(60);
  expect(period()).toEqual({ kind: 'day' });
  expect(address()).toBe('period=day');
  act({ period: { kind: 'hour' } });
  expect(address()).toBe('period=hour');
});

test.each([
  [3_600, 'hour'],
  [3_601, 'day'],
])('a moment of %d s ago is in the period that is opened on', (ago, kind) => {
  follow(`at=${NOW - ago}`);
  remember(SHORT_S - 1);
  expect(period()).toEqual({ kind });
});
