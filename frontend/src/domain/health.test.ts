import { describe, expect, test } from 'vitest';

import { readings, tag } from '../testing/tags';
import { deviation, houseHealth, newlyCritical, sideOf, statusOf, tagHealth } from './health';
import { sensorNamed } from './sensors';

const ideal = sensorNamed('temperature').ideal ?? [NaN, NaN];
const [low, high] = ideal;
const width = high - low;

describe('deviation', () => {
  test('is 0 inside the range, its ends included', () => {
    expect(deviation(ideal, low)).toBe(0);
    expect(deviation(ideal, (low + high) / 2)).toBe(0);
    expect(deviation(ideal, high)).toBe(0);
  });

  test('is the distance to the nearest bound over the width', () => {
    expect(deviation(ideal, low - width / 4)).toBeCloseTo(0.25);
    expect(deviation(ideal, high + width)).toBeCloseTo(1);
  });

  test('is clamped to 2', () => {
    expect(deviation(ideal, high + 50 * width)).toBe(2);
  });
});

test.each([
  [0, 'healthy'],
  [0.299, 'healthy'],
  [0.3, 'stressed'],
  [0.699, 'stressed'],
  [0.7, 'critical'],
  [2, 'critical'],
  [null, 'no-data'],
] as const)('a deviation of %s is %s', (value, status) => {
  expect(statusOf(value)).toBe(status);
});

test('which side of the ideal range', () => {
  expect(sideOf(ideal, low - 1)).toBe('below');
  expect(sideOf(ideal, low)).toBe('within');
  expect(sideOf(ideal, high + 1)).toBe('above');
  expect(sideOf(null, 1)).toBeNull();
});

describe('tag', () => {
  test('is as healthy as its worst sensor, which is named', () => {
    const sick = tag({ readings: readings({ humidity: 60, temperature: high + width / 2 }) });
    expect(tagHealth(sick)).toMatchObject({ status: 'stressed', sensor: 'temperature' });
  });

  test('without a reading that can be judged it has no data', () => {
    for (const values of [{}, { temperature: null }, { ph: 7 }]) {
      expect(tagHealth(tag({ readings: readings(values) })).status).toBe('no-data');
    }
  });
});

describe('house', () => {
  const fine = tag({ tag_id: '1', readings: readings({ temperature: low }) });
  const sick = tag({ tag_id: '2', readings: readings({ temperature: high + width }) });
  const unknown = tag({ tag_id: '3' });

  test('is as healthy as its worst tag, which is named; all are counted', () => {
    const house = houseHealth([fine, sick, unknown]);
    expect(house.status).toBe('critical');
    expect(house.worst).toMatchObject({ tagId: '2', sensor: 'temperature', value: high + width });
    expect(house.counts).toEqual({ healthy: 1, stressed: 0, critical: 1, 'no-data': 1 });
    expect(house.byTag.get('3')?.status).toBe('no-data');
  });

  test('of equals the first drives it', () => {
    expect(
      houseHealth([
        fine,
        tag({ tag_id: '4', readings: fine.readings.size ? readings({ temperature: low }) : [] }),
      ]).worst?.tagId,
    ).toBe('1');
  });

  test('an empty one has no data and no driver', () => {
    expect(houseHealth([])).toMatchObject({ status: 'no-data', worst: null });
  });
});

test('of a tag’s equally bad sensors the first reported drives it', () => {
  // Both are at the clamp.
  for (const names of [
    ['temperature', 'humidity'],
    ['humidity', 'temperature'],
  ]) {
    const values = Object.fromEntries(names.map((name) => [name, 1e6]));
    expect(tagHealth(tag({ readings: readings(values) })).sensor).toBe(names[0]);
  }
});

test('newly critical is who was not critical before, or not there', () => {
  const house = (temperatures: Record<string, number>): ReturnType<typeof houseHealth> =>
    houseHealth(
      Object.entries(temperatures).map(([tag_id, temperature]) =>
        tag({ tag_id, readings: readings({ temperature }) }),
      ),
    );
  const before = house({ 1: high + width, 2: low });
  const now = house({ 1: high + width, 2: high + width, 3: high + width, 4: low });
  expect(newlyCritical(before, now).map(({ tagId }) => tagId)).toEqual(['2', '3']);
  expect(newlyCritical(now, before)).toEqual([]);
  expect(newlyCritical(now, now)).toEqual([]);
});
