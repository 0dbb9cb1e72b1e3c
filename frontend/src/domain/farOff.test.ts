import { describe, expect, test } from 'vitest';

import cases from '../../../tests/twin/core/far_off.json';
import { mapPoint } from '../geometry/coordinates';
import { holds, reachOf } from './twin';

describe('the cases that the twin knows too', () => {
  test.each(Object.entries(cases))('%s', (_, { at, far }) => {
    const places = at.map(([x, y]) => mapPoint(x ?? NaN, y ?? NaN));
    const reach = reachOf(places);
    const found = places.flatMap((place, index) => (holds(reach, place) ? [] : [index]));
    expect(found).toEqual(far);
  });
});
