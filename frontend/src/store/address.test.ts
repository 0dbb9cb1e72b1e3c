import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

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

test('a link that is opened while the address settles is not written over', () => {
  act({ type: 'sensor', sensor: 'humidity' });
  history.replaceState(null, '', '#sensor=light');
  vi.advanceTimersByTime(500);
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

test('a wall screen shows now, whatever moment its link holds', () => {
  stop();
  history.replaceState(null, '', '/?kiosk=1#at=77&sensor=co2');
  stop = startAddress(true);
  expect(store.get().view).toMatchObject({ sensor: 'co2', moment: null });
});

test('where a round goes through the sensors only the rest comes back to the link', () => {
  stop();
  stop = startAddress(true, true);
  // No change of the sensor puts the return off.
  for (const sensor of ['light', 'humidity', 'temperature']) {
    if (sensor === 'humidity') act({ type: 'layer', layer: 'grid', on: false });
    act({ type: 'sensor', sensor });
    vi.advanceTimersByTime(60_000);
  }
  expect(store.get().view.layers.has('grid')).toBe(true);
  expect(store.get().view.sensor).toBe('temperature');
  expect(vi.getTimerCount()).toBe(0);
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

describe('a card is a step of the browser’s history', () => {
  /** What the browser does with a step, in its own time. */
  const travel = async (steps: number): Promise<void> => {
    const arrived = new Promise((resolve) => {
      window.addEventListener('popstate', resolve, { once: true });
    });
    history.go(steps);
    await arrived;
  };
  const arrival = (): Promise<unknown> =>
    new Promise((resolve) => {
      window.addEventListener('popstate', resolve, { once: true });
    });

  beforeEach(() => {
    // The history's steps are timers too.
    vi.useRealTimers();
    stop();
    history.replaceState(null, '', '/#sensor=co2');
    stop = startAddress();
  });

  test('Back closes it and undoes nothing else; Forward opens it again', async () => {
    const length = history.length;
    act({ type: 'select', tagId: '7' });
    expect(location.hash).toBe('#sensor=co2&tag=7');
    act({ type: 'select', tagId: '8' });
    act({ type: 'sensor', sensor: 'light' });
    await vi.waitFor(() => {
      expect(location.hash).toBe('#sensor=light&tag=8');
    });
    expect(history.length).toBe(length + 1);
    await travel(-1);
    expect(store.get().view).toMatchObject({ selected: null, sensor: 'light' });
    expect(location.hash).toBe('#sensor=light');
    await travel(1);
    expect(store.get().view).toMatchObject({ selected: '8', sensor: 'light' });
  });

  test('one that is closed by hand leaves no step that does nothing', async () => {
    for (const tagId of ['7', '8']) {
      act({ type: 'select', tagId });
      const back = arrival();
      act({ type: 'select', tagId: null });
      await back;
      expect(location.hash).toBe('#sensor=co2');
      expect(history.state).toMatchObject({ tag: null });
    }
  });

  test('one that is opened while the last is being left has its step', async () => {
    act({ type: 'select', tagId: '7' });
    const back = arrival();
    act({ type: 'select', tagId: null });
    act({ type: 'select', tagId: '8' });
    await back;
    expect(location.hash).toBe('#sensor=co2&tag=8');
    await travel(-1);
    expect(store.get().view.selected).toBeNull();
  });

  test('so is a look back, from which Back leads to now, and Forward there again', async () => {
    act({ type: 'moment', moment: 500 });
    expect(location.hash).toBe('#at=500&sensor=co2');
    act({ type: 'moment', moment: 400 });
    await vi.waitFor(() => {
      expect(location.hash).toBe('#at=400&sensor=co2');
    });
    // One step for all of it.
    expect(history.state).toMatchObject({ opened: 'moment', moment: 400 });
    await travel(-1);
    expect(store.get().view.moment).toBeNull();
    expect(location.hash).toBe('#sensor=co2');
    await travel(1);
    expect(store.get().view.moment).toBe(400);
    const back = arrival();
    act({ type: 'moment', moment: null });
    await back;
    expect(location.hash).toBe('#sensor=co2');
  });

  test('a card that opens while it looks back is closed by Back, and the moment stays', async () => {
    act({ type: 'moment', moment: 500 });
    act({ type: 'select', tagId: '7' });
    act({ type: 'moment', moment: 300 });
    await travel(-1);
    expect(store.get().view).toMatchObject({ selected: null, moment: 300 });
    await travel(-1);
    expect(store.get().view).toMatchObject({ selected: null, moment: null });
  });

  test('now beside a card that was opened later is no step back', async () => {
    act({ type: 'moment', moment: 500 });
    act({ type: 'select', tagId: '7' });
    act({ type: 'moment', moment: null });
    await vi.waitFor(() => {
      expect(location.hash).toBe('#sensor=co2&tag=7');
    });
    expect(history.state).toMatchObject({ opened: 'tag', tag: '7', moment: null });
    await travel(-1);
    expect(store.get().view).toMatchObject({ selected: null, moment: 500 });
  });

  test('a link to a moment is shown as it is; now is no step, for there is none before', async () => {
    stop();
    history.replaceState(null, '', '/#at=500');
    stop = startAddress();
    const { length } = history;
    act({ type: 'moment', moment: null });
    await vi.waitFor(() => {
      expect(location.hash).toBe('');
    });
    expect(history.length).toBe(length);
  });

  test('Back to a link before the last one follows it whole', async () => {
    history.pushState(null, '', '#sensor=light&tag=3');
    window.dispatchEvent(new HashChangeEvent('hashchange'));
    expect(store.get().view).toMatchObject({ selected: '3', sensor: 'light' });
    await travel(-1);
    expect(store.get().view).toMatchObject({ selected: null, sensor: 'co2' });
  });
});
