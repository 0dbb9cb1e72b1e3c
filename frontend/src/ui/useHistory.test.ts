import { expect, test } from 'vitest';

import { wireTime } from '../testing/timeline';
import { asOf } from './TagCard';

test('at a past moment the card has the attempts until then', () => {
  const history = {
    tag_id: '1',
    source: null,
    tries: [10, 20, 30].map((at) => ({
      stamp: wireTime(at),
      status: 0,
      status_detail: '',
      kind: 0,
    })),
    sensors: [
      { name: 'co2', values: [10, 20.5].map((at) => ({ stamp: wireTime(at), value: at })) },
    ],
  };
  const then = asOf(history, 20);
  expect(then.tries.map(({ stamp }) => stamp.sec)).toEqual([10, 20]);
  expect(then.sensors[0]?.values.map(({ value }) => value)).toEqual([10]);
  expect(asOf(history, null)).toBe(history);
});
