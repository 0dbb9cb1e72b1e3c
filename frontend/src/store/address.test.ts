import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import { fromFragment, type Linked, startAddress, toFragment } from './address';
import { act, store } from './app';
import { DEFAULT_LAYERS, DEFAULT_VIEW, LONGEST_FILTER, withLayer, withTag } from './view';
import { started } from '../testing/life';

let stop: () => void;

beforeEach(() => {
  vi.useFakeTimers();
  act(DEFAULT_VIEW);
  history.replaceState(null, '', '/?kiosk=1#sensor=co2&tag=7');
  stop = started((on) => startAddress(false, false, on));
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
  act({ sensor: 'humidity' });
  history.replaceState(null, '', '#sensor=light');
  vi.advanceTimersByTime(500);
  window.dispatchEvent(new HashChangeEvent('hashchange'));
  expect(store.get().view).toMatchObject({ sensor: 'light', selected: null });
});

test('the address follows the view once it has settled, and keeps the rest', () => {
  act({ sensor: 'humidity' });
  act({ camera: { x: 1, y: 2, span: 3 } });
  expect(location.hash).toBe('#sensor=co2&tag=7');
  vi.advanceTimersByTime(500);
  expect(location.hash).toBe('#sensor=humidity&tag=7&view=1.00,2.00,3.00');
  expect(location.search).toBe('?kiosk=1');
});

test('a wall screen shows now, whatever moment its link holds', () => {
  stop();
  history.replaceState(null, '', '/?kiosk=1#at=77&sensor=co2');
  stop = started((on) => startAddress(true, false, on));
  expect(store.get().view).toMatchObject({ sensor: 'co2', moment: null });
});

test('where a round goes through the sensors only the rest comes back to the link', () => {
  stop();
  stop = started((on) => startAddress(true, true, on));
  // Changes of the sensor do not delay the return.
  for (const sensor of ['light', 'humidity', 'temperature']) {
    if (sensor === 'humidity') act(withLayer('grid', false));
    act({ sensor });
    vi.advanceTimersByTime(60_000);
  }
  expect(store.get().view.layers.has('grid')).toBe(true);
  expect(store.get().view.sensor).toBe('temperature');
  expect(vi.getTimerCount()).toBe(0);
});

test('a wall screen chooses no tag, leaves its address alone, and comes back to it', () => {
  stop();
  stop = started((on) => startAddress(true, false, on));
  expect(store.get().view).toMatchObject({ sensor: 'co2', selected: null });
  act({ sensor: 'humidity' });
  vi.advanceTimersByTime(60_000);
  expect(location.hash).toBe('#sensor=co2&tag=7');
  // Somebody is still there.
  act({ sensor: 'light' });
  vi.advanceTimersByTime(119_000);
  expect(store.get().view.sensor).toBe('light');
  vi.advanceTimersByTime(1_000);
  expect(store.get().view.sensor).toBe('co2');
  expect(vi.getTimerCount()).toBe(0);
});

describe('a card is a step of the browser’s history', () => {
  /** The browser's asynchronous step. */
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
    // Steps of the history use timers too.
    vi.useRealTimers();
    stop();
    history.replaceState(null, '', '/#sensor=co2');
    stop = started((on) => startAddress(false, false, on));
  });

  test('Back closes it and undoes nothing else; Forward opens it again', async () => {
    const length = history.length;
    act(withTag('7'));
    expect(location.hash).toBe('#sensor=co2&tag=7');
    act(withTag('8'));
    act({ sensor: 'light' });
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
      act(withTag(tagId));
      const back = arrival();
      act(withTag(null));
      await back;
      expect(location.hash).toBe('#sensor=co2');
      expect(history.state).toMatchObject({ tag: null });
    }
  });

  test('one that is opened while the last is being left has its step', async () => {
    act(withTag('7'));
    const back = arrival();
    act(withTag(null));
    act(withTag('8'));
    await back;
    expect(location.hash).toBe('#sensor=co2&tag=8');
    await travel(-1);
    expect(store.get().view.selected).toBeNull();
  });

  test('so is a look back, from which Back leads to now, and Forward there again', async () => {
    act({ moment: 500 });
    expect(location.hash).toBe('#at=500&sensor=co2');
    act({ moment: 400 });
    await vi.waitFor(() => {
      expect(location.hash).toBe('#at=400&sensor=co2');
    });
    // One step for all changes.
    expect(history.state).toMatchObject({ opened: 'moment', moment: 400 });
    await travel(-1);
    expect(store.get().view.moment).toBeNull();
    expect(location.hash).toBe('#sensor=co2');
    await travel(1);
    expect(store.get().view.moment).toBe(400);
    const back = arrival();
    act({ moment: null });
    await back;
    expect(location.hash).toBe('#sensor=co2');
  });

  test('a card that opens while it looks back is closed by Back, and the moment stays', async () => {
    act({ moment: 500 });
    act(withTag('7'));
    act({ moment: 300 });
    await travel(-1);
    expect(store.get().view).toMatchObject({ selected: null, moment: 300 });
    await travel(-1);
    expect(store.get().view).toMatchObject({ selected: null, moment: null });
  });

  test('now beside a card that was opened later is no step back', async () => {
    act({ moment: 500 });
    act(withTag('7'));
    act({ moment: null });
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
    stop = started((on) => startAddress(false, false, on));
    const { length } = history;
    act({ moment: null });
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

describe('permalink', () => {
  test('a plain view needs no fragment', () => {
    expect(toFragment(DEFAULT_VIEW)).toBe('');
    expect(fromFragment('')).toMatchObject({ sensor: DEFAULT_VIEW.sensor, camera: null });
  });

  test('everything survives the way there and back', () => {
    const view: Linked = {
      moment: 1_794_000_000.125,
      period: { kind: 'own', from: 1_793_000_000, to: 1_794_100_000.5 },
      compare: 'day',
      chart: { by: 'sensor', tagIds: ['a,b', '2'] },
      sensor: 'soil_moisture',
      selected: 'tag 7/ä&#',
      camera: { x: -1.25, y: 4.5, span: 6.75 },
      heat: 'error',
      colouring: 'value',
      kept: { sensor: 'soil_moisture', low: -3, high: 12.5 },
      layers: new Set(['map', 'field', 'pins']),
      sort: { column: 'soil_moisture', descending: true },
      filter: 'basil & "pest"',
      health: 'unknown',
      list: 'alarms',
      pane: 'tags',
    };
    expect(fromFragment(`#${toFragment(view)}`)).toEqual(view);
  });

  test.each([
    ['period=week', { kind: 'week' }],
    ['period=all', { kind: 'all' }],
    ['period=100,250.5', { kind: 'own', from: 100, to: 250.5 }],
  ] as const)('%s is a period', (fragment, period) => {
    expect(fromFragment(fragment).period).toEqual(period);
    expect(toFragment({ ...DEFAULT_VIEW, period })).toBe(fragment);
  });

  test.each([
    ['compare=week', { compare: 'week' }],
    ['heat=estimate', { heat: 'estimate' }],
    ['chart.tag=5', { chart: { by: 'tag', tagIds: ['5'] } }],
    ['chart.sensor=5&chart.sensor=7', { chart: { by: 'sensor', tagIds: ['5', '7'] } }],
  ] as const)('%s is held', (fragment, part) => {
    expect(fromFragment(fragment)).toMatchObject(part);
    expect(toFragment({ ...DEFAULT_VIEW, ...part })).toBe(fragment);
  });

  test('a chart has eight tags at most, and none twice', () => {
    const ids = (many: number): string =>
      Array.from({ length: many }, (_, index) => `chart.sensor=${index}`).join('&');
    expect(fromFragment(ids(8)).chart?.tagIds).toHaveLength(8);
    expect(fromFragment(ids(9)).chart?.tagIds).toHaveLength(8);
    expect(fromFragment('chart.sensor=1&chart.sensor=1').chart?.tagIds).toEqual(['1']);
  });

  test('a moment is held to the millisecond', () => {
    expect(toFragment({ ...DEFAULT_VIEW, moment: 1_794_000_000.125 })).toBe('at=1794000000.125');
    expect(fromFragment('at=1794000000.1254').moment).toBe(1_794_000_000.125);
    expect(fromFragment('at=0').moment).toBe(0);
  });

  test('no layer at all is a choice too', () => {
    const view = { ...DEFAULT_VIEW, layers: new Set<never>() };
    expect(fromFragment(toFragment(view)).layers.size).toBe(0);
  });

  test.each([
    'compare=',
    'compare=yesterday',
    'compare=-0',
    'chart.tag=',
    'chart=5',
    'at=',
    'at=-1',
    'at=yesterday',
    'at=1e999',
    'period=fortnight',
    'period=5,5',
    'period=9,1',
    'period=-1,1',
    'view=1,2',
    'view=1e30,2,3',
    'view=1,-1e308,3',
    'view=1,2,0',
    'view=1,2,-4',
    'view=a,b,c',
    'view=,,',
    'range=5,5',
    'range=9,1',
    'range=1,Infinity',
    'range.co2=9,1',
    'range.=1,9',
    'sensor=&tag=',
    'nonsense',
    'sort=-',
    'sort=',
    'health=ill',
    'health=',
    'filter=',
    'colour=',
    'colour=rainbow',
    'range=3,2',
    'heat=',
    'heat=idw',
    'list=tags',
    'list=notes',
  ])('%s is passed over', (fragment) => {
    expect(fromFragment(fragment)).toEqual({
      moment: null,
      period: { kind: 'day' },
      compare: null,
      chart: null,
      sensor: DEFAULT_VIEW.sensor,
      selected: null,
      camera: null,
      heat: 'nearest',
      colouring: 'ideal',
      kept: null,
      layers: DEFAULT_LAYERS,
      sort: DEFAULT_VIEW.sort,
      filter: '',
      health: null,
      list: 'tags',
    });
  });

  test('what is as by default is left out of the table’s part too', () => {
    const sort = { column: 'age', descending: false };
    expect(toFragment({ ...DEFAULT_VIEW, sort, filter: 'a b', health: 'critical' })).toBe(
      'sort=age&filter=a+b&health=critical',
    );
    const tag = { column: 'tag', descending: true };
    expect(toFragment({ ...DEFAULT_VIEW, sort: tag })).toBe('sort=-tag');
    const upwards = { column: 'tag', descending: false };
    expect(toFragment({ ...DEFAULT_VIEW, sort: upwards })).toBe('sort=tag');
    expect(fromFragment('sort=tag').sort).toEqual(upwards);
  });

  test('a filter is as long as one can type', () => {
    const text = 'x'.repeat(LONGEST_FILTER);
    expect(fromFragment(`filter=${text}`).filter).toBe(text);
    expect(fromFragment(`filter=${text}y`).filter).toBe(text);
  });

  test('an unknown layer is passed over', () => {
    expect([...fromFragment('layers=pins,lasers').layers]).toEqual(['pins']);
  });
});
