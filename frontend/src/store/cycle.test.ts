import { afterEach, beforeEach, expect, test, vi } from 'vitest';

import { started } from '../testing/life';
import { showTags } from '../testing/page';
import { CATALOGUE } from '../testing/sensors';
import { readings, tag, wireTag } from '../testing/tags';
import { act, store } from './app';
import { addressOfPage, cycleSeconds, sensorsOf, startCycle } from './cycle';
import { DEFAULT_VIEW } from './view';

let stop: () => void;

beforeEach(() => {
  vi.useFakeTimers();
  act(DEFAULT_VIEW);
  showTags([
    wireTag({ readings: readings({ temperature: 20, humidity: 60 }) }),
    wireTag({ tag_id: '2', readings: readings({ co2: 500 }) }),
  ]);
});

afterEach(() => {
  stop();
  vi.useRealTimers();
});

const inView = (): string => store.get().view.sensor;
const pass = (seconds: number): void => {
  vi.advanceTimersByTime(seconds * 1000);
};

test('shows each sensor that exists for as long as was wished', () => {
  stop = started((on) => startCycle(30, on));
  pass(29.9);
  expect(inView()).toBe('temperature');
  act({ moment: 500 });
  pass(30);
  act({ moment: null });
  expect(inView()).toBe('temperature');
  const seen = [0, 1, 2].map(() => {
    pass(30);
    return inView();
  });
  expect(seen).toEqual(['humidity', 'co2', 'temperature']);
});

test('one sensor stays, and without a wish nothing changes', () => {
  stop = started((on) => startCycle(null, on));
  pass(10_000);
  expect(inView()).toBe('temperature');
  stop();
  showTags([wireTag({ readings: readings({ temperature: 20 }) })]);
  stop = started((on) => startCycle(5, on));
  pass(10);
  expect(inView()).toBe('temperature');
});

test.each([
  ['?kiosk=1&cycle=30', 30],
  ['?cycle=4', 5],
  ['?cycle=-30', 5],
  ['?cycle=99999', 3_600],
  ['?cycle=soon', null],
  ['?cycle=', null],
  ['?kiosk=1', null],
])('the wish “%s” is for %s seconds', (search, seconds) => {
  expect(cycleSeconds(search)).toBe(seconds);
});

test('a round has the sensors that some tag has, in their usual order, failed ones too', () => {
  const tags = [
    tag({ readings: readings({ co2: null }) }),
    tag({ tag_id: '2', readings: readings({ temperature: 20 }) }),
  ];
  expect(sensorsOf(tags, CATALOGUE.all).map(({ name }) => name)).toEqual(['temperature', 'co2']);
});

test('whoever leaves keeps the rest of the address', () => {
  expect(addressOfPage('?kiosk=1&cycle=30', '#sensor=co2')).toBe('?#sensor=co2');
  expect(addressOfPage('?lang=de&kiosk=1', '')).toBe('?lang=de');
});
