import { expect, test, vi } from 'vitest';

import { memoLast, memoOne } from './memo';

test('the same arguments give the same object', () => {
  const compute = vi.fn((a: number, b: number) => ({ sum: a + b }));
  const memo = memoLast(compute);
  const first = memo(1, 2);
  expect(memo(1, 2)).toBe(first);
  expect(memo(1, 3)).not.toBe(first);
  expect(compute).toHaveBeenCalledTimes(2);
});

test('each object that is still about keeps its own result', () => {
  const compute = vi.fn(({ a }: { readonly a: number }) => ({ twice: 2 * a }));
  const memo = memoOne(compute);
  const [one, two] = [{ a: 1 }, { a: 2 }];
  const first = memo(one);
  memo(two);
  expect(memo(one)).toBe(first);
  expect(compute).toHaveBeenCalledTimes(2);
});
