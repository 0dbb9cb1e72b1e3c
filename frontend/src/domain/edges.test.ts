import { expect, test } from 'vitest';

import type { Field } from '../contract/types';
import { fieldWith } from '../testing/field';
import { edgesOf } from './edges';

const field = (rows: readonly (readonly number[])[]): Field =>
  fieldWith(rows, { originX: 10, originY: 20, resolution: 0.5 });

test('runs around what is known, each straight side once', () => {
  expect(edgesOf(field([[NaN, 1, 1]]))).toEqual([
    ...[10.5, 20, 11.5, 20],
    ...[10.5, 20.5, 11.5, 20.5],
    ...[10.5, 20, 10.5, 20.5],
    ...[11.5, 20, 11.5, 20.5],
  ]);
});

test('a hole has an edge too, and what is not known at all has none', () => {
  const ring = [
    [1, 1, 1],
    [1, NaN, 1],
    [1, 1, 1],
  ];
  expect(edgesOf(field(ring))).toHaveLength(4 * 8);
  expect(edgesOf(field([[NaN, NaN]]))).toEqual([]);
});
