import { describe, expect, test } from 'vitest';

import { readings, tag } from '../testing/tags';
import { addressOfPage, cycleWish, sensorAfter, sensorsOf } from './cycle';
import { CATALOGUE, sensorNamed } from '../testing/sensors';

describe('the wish', () => {
  test.each(['5', '30', '3600'])('%s seconds are taken', (text) => {
    expect(cycleWish(`?kiosk=1&cycle=${text}`)).toEqual({ seconds: Number(text), refused: null });
  });

  test.each(['4', '3601', '', '-30', '30.5', '3e1', 'soon', 'NaN', '99999'])(
    '“%s” is refused, and said',
    (text) => {
      expect(cycleWish(`?cycle=${encodeURIComponent(text)}`)).toEqual({
        seconds: null,
        refused: text,
      });
    },
  );

  test('none is no mistake', () => {
    expect(cycleWish('?kiosk=1')).toEqual({ seconds: null, refused: null });
  });
});

describe('the round', () => {
  const [first, second, third] = ['temperature', 'humidity', 'co2'].map(sensorNamed);
  const three = [first, second, third].filter((sensor) => sensor !== undefined);

  test('goes through all and begins again', () => {
    expect(sensorAfter(three, 'temperature')).toBe(second);
    expect(sensorAfter(three, 'co2')).toBe(first);
  });

  test('begins with the first where the one in view is not among them', () => {
    expect(sensorAfter(three, 'light')).toBe(first);
  });

  test('one sensor, or none, is no round', () => {
    expect(sensorAfter(three.slice(0, 1), 'temperature')).toBeNull();
    expect(sensorAfter([], 'temperature')).toBeNull();
  });

  test('has the sensors that some tag has, in their usual order, failed ones too', () => {
    const tags = [
      tag({ readings: readings({ co2: null }) }),
      tag({ tag_id: '2', readings: readings({ temperature: 20 }) }),
    ];
    expect(sensorsOf(tags, CATALOGUE.all).map(({ name }) => name)).toEqual(['temperature', 'co2']);
  });
});

test('whoever leaves keeps the rest of the address', () => {
  expect(addressOfPage('?kiosk=1&cycle=30', '#sensor=co2')).toBe('?#sensor=co2');
  expect(addressOfPage('?lang=de&kiosk=1', '')).toBe('?lang=de');
});
