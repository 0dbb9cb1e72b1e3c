import { render, screen } from '@testing-library/react';
import { beforeEach, expect, test, vi } from 'vitest';

import { ErrorBoundary } from './ErrorBoundary';
import * as reload from './reload';

const Broken = (): never => {
  throw new TypeError('tag.pose is \u202enull');
};

beforeEach(() => {
  vi.spyOn(console, 'error').mockImplementation(() => undefined);
});

test.each([
  [false, 0],
  [true, 1],
])('a page that fails says so; on a wall screen (%s) it comes back by itself', (kiosk, times) => {
  const stop = vi.fn();
  const byItself = vi.spyOn(reload, 'reloadByItself').mockReturnValue(stop);
  const { unmount } = render(
    <ErrorBoundary kiosk={kiosk}>
      <Broken />
    </ErrorBoundary>,
  );
  const page = screen.getByRole('alert');
  expect(page.textContent).toContain('TypeError: tag.pose is \ufffdnull');
  expect(screen.getByRole('button', { name: 'Reload' })).toBeTruthy();
  expect(byItself).toHaveBeenCalledTimes(times);
  unmount();
  expect(stop).toHaveBeenCalledTimes(times);
});

test('one that does not fail is left alone', () => {
  render(<ErrorBoundary kiosk={false}>well</ErrorBoundary>);
  expect(screen.getByText('well')).toBeTruthy();
  expect(screen.queryByRole('alert')).toBeNull();
});
