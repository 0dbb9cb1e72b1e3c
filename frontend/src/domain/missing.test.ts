import { expect, test } from 'vitest';

import { wireTime } from '../testing/timeline';
import { missingOf } from './missing';

const told = (
  keptFrom: number | null,
  completeTo: number | null,
): Parameters<typeof missingOf>[0] => ({
  from: wireTime(100),
  to: wireTime(200),
  kept_from: keptFrom === null ? null : wireTime(keptFrom),
  complete_to: completeTo === null ? null : wireTime(completeTo),
});

test('what is kept and complete, or of which nobody knows, misses nothing', () => {
  expect(missingOf(told(100, 200), 300)).toEqual([]);
  expect(missingOf(told(null, null), 300)).toEqual([]);
});

test('before what is kept, and behind what is complete, something is missing', () => {
  expect(missingOf(told(120, 160), 300)).toEqual([
    { from: 100, to: 120, why: 'not_kept' },
    { from: 160, to: 200, why: 'not_recorded' },
  ]);
});

test('what has not come yet is not missing, nor what is about to be written', () => {
  expect(missingOf(told(100, 150), 155)).toEqual([]);
  expect(missingOf(told(100, 150), 156)).toEqual([{ from: 150, to: 156, why: 'not_recorded' }]);
});
