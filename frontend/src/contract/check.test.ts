import { describe, expect, test } from 'vitest';

import {
  also,
  boolean,
  count,
  integer,
  list,
  number,
  numberOrNull,
  object,
  oneOf,
  optional,
  orNull,
  text,
} from './check';

describe('what passes, and what is said of the rest', () => {
  test.each([
    [number, 1.5, '1.5', ': a number, not "1.5"'],
    [number, 0, Infinity, ': a number, not Infinity'],
    [number, 0, null, ': a number, not null'],
    [numberOrNull, null, NaN, ': a number or null, not NaN'],
    [numberOrNull, 2, undefined, ': is missing'],
    [count, 0, -1, ': a whole number, not -1'],
    [count, 7, 1.5, ': a whole number, not 1.5'],
    [integer, -3, 2 ** 53, ': a whole number, not 9007199254740992'],
    [boolean, false, 0, ': true or false, not 0'],
    [text(3), 'abc', 'abcd', ': 4 characters, the limit is 3'],
    [text(3), '', ['a'], ': text, not a list of 1'],
    [oneOf('a', 'b'), 'b', 'c', ': one of a, b, not "c"'],
    [orNull(text(3)), null, 7, ': text, not 7'],
    [optional(text(3)), undefined, null, ': text, not null'],
    [list(number, 2), [1, 2], [1, 2, 3], ': 3 entries, the limit is 2'],
    [list(number, 2), [], { length: 0 }, ': a list, not an object'],
    [list(number, 2), [1], [1, null], '[1]: a number, not null'],
    [object({ a: number }), { a: 1, b: 2 }, { b: 2 }, '.a: is missing'],
    [object({ a: number }), { a: 1 }, [1], ': an object, not a list of 1'],
    [
      object({ a: object({ b: boolean }) }),
      { a: { b: true } },
      { a: null },
      '.a: an object, not null',
    ],
    [also(text(9), oneOf('x')), 'x', 'y', ': one of x, not "y"'],
  ])('%#', (check, good, wrong, said) => {
    expect(check(good)).toBeNull();
    expect(check(wrong)).toBe(said);
  });

  test('a wrong value of any length is told in short', () => {
    expect(number('x'.repeat(1_000_000))?.length).toBeLessThan(80);
  });
});
