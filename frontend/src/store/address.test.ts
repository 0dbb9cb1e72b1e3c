import { afterEach, beforeEach, expect, test, vi } from 'vitest';

import { startAddress } from './address';
import { act, store } from './app';
import { DEFAULT_VIEW } from './view';

let stop: () => void;

beforeEach(() => {
  vi.useFakeTimers();
  act({ type: 'look', view: DEFAULT_VIEW });
  history.replaceState(null, '', '/?kiosk=1#sensor=co2&tag=7');
  stop = startAddress();
});
afterEach(() => {
  stop();
  vi.useRealTimers();
});

test('a link that is opened is followed', () => {
  expect(store.get().view).toMatchObject({ sensor: 'co2', selected: '7' });
});

test('a link that is pasted into the open page is followed too', () => {
  history.replaceState(null, '', '#sensor=light');
  window.dispatchEvent(new HashChangeEvent('hashchange'));
  expect(store.get().view).toMatchObject({ sensor: 'light', selected: null });
});

test('the address follows the view once it has settled, and keeps the rest', () => {
  act({ type: 'sensor', sensor: 'humidity' });
  act({ type: 'camera', camera: { x: 1, y: 2, span: 3 } });
  expect(location.hash).toBe('#sensor=co2&tag=7');
  vi.advanceTimersByTime(500);
  expect(location.hash).toBe('#sensor=humidity&tag=7&view=1.00,2.00,3.00');
  expect(location.search).toBe('?kiosk=1');
});

test('a wall screen chooses no tag, leaves its address alone, and comes back to it', () => {
  stop();
  stop = startAddress(true);
  expect(store.get().view).toMatchObject({ sensor: 'co2', selected: null });
  act({ type: 'sensor', sensor: 'humidity' });
  vi.advanceTimersByTime(60_000);
  expect(location.hash).toBe('#sensor=co2&tag=7');
  // Somebody is still there.
  act({ type: 'sensor', sensor: 'light' });
  vi.advanceTimersByTime(119_000);
  expect(store.get().view.sensor).toBe('light');
  vi.advanceTimersByTime(1_000);
  expect(store.get().view.sensor).toBe('co2');
  expect(vi.getTimerCount()).toBe(0);
});
