import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import { showTags } from '../testing/page';
import { CATALOGUE } from '../testing/sensors';
import { readings, tag, wireTag } from '../testing/tags';
import { act, store } from './app';
import { addressOfPage, cycleSetting, sensorsOf, startCycle } from './cycle';
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
  stop = startCycle({ seconds: 30, refused: null });
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
  stop = startCycle({ seconds: null, refused: 'soon' });
  pass(10_000);
  expect(inView()).toBe('temperature');
  stop();
  showTags([wireTag({ readings: readings({ temperature: 20 }) })]);
  stop = startCycle({ seconds: 5, refused: null });
  pass(10);
  expect(inView()).toBe('temperature');
});

describe('the wish', () => {
  test.each(['5', '30', '3600'])('%s seconds are taken', (text) => {
    expect(cycleSetting(`?kiosk=1&cycle=${text}`)).toEqual({
      seconds: Number(text),
      refused: null,
    });
  });

  test.each(['4', '3601', '', '-30', '30.5', '3e1', 'soon', 'NaN', '99999'])(
    '“%s” is refused, and said',
    (text) => {
      expect(cycleSetting(`?cycle=${encodeURIComponent(text)}`)).toEqual({
        seconds: null,
        refused: text,
      });
    },
  );

  test('none is no mistake', () => {
    expect(cycleSetting('?kiosk=1')).toEqual({ seconds: null, refused: null });
  });
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
