import { afterEach, beforeEach, expect, test, vi } from 'vitest';

import { readings, stateFrame, wireTag } from '../testing/tags';
import { showTags } from '../testing/page';
import { act, receive, store } from './app';
import { nextSensor, startCycle } from './cycle';
import { DEFAULT_VIEW } from './view';

let stop: () => void;

beforeEach(() => {
  vi.useFakeTimers();
  act({ type: 'look', view: DEFAULT_VIEW });
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
  expect(nextSensor.get()?.sensor.name).toBe('humidity');
  pass(29.9);
  expect(inView()).toBe('temperature');
  const seen = [0, 1, 2].map(() => {
    pass(30);
    return inView();
  });
  expect(seen).toEqual(['humidity', 'co2', 'temperature']);
});

test('news do not put it off, a choice by hand does', () => {
  stop = startCycle({ seconds: 30, refused: null });
  pass(20);
  const tags = [wireTag({ readings: readings({ temperature: 21, humidity: 61, light: 900 }) })];
  receive({ type: 'state', latest: stateFrame(tags, { sec: 9_999 }), now: performance.now() });
  pass(10);
  expect(inView()).toBe('humidity');
  pass(20);
  act({ type: 'sensor', sensor: 'temperature' });
  pass(29);
  expect(inView()).toBe('temperature');
  pass(1);
  expect(inView()).toBe('humidity');
});

test('stands still while the page looks back, and goes on with a whole turn', () => {
  stop = startCycle({ seconds: 30, refused: null });
  act({ type: 'moment', moment: 500 });
  expect(nextSensor.get()).toBeNull();
  pass(300);
  expect(inView()).toBe('temperature');
  act({ type: 'moment', moment: null });
  pass(29);
  expect(inView()).toBe('temperature');
  pass(1);
  expect(inView()).toBe('humidity');
});

test('one sensor stays, and without a wish nothing changes', () => {
  stop = startCycle({ seconds: null, refused: 'soon' });
  pass(10_000);
  expect(inView()).toBe('temperature');
  stop();
  showTags([wireTag({ readings: readings({ temperature: 20 }) })]);
  stop = startCycle({ seconds: 5, refused: null });
  expect(nextSensor.get()).toBeNull();
});
