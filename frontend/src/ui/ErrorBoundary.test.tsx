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

test('a page that fails says so, and comes back by itself', () => {
  const stop = vi.fn();
  const byItself = vi.spyOn(reload, 'reloadByItself').mockReturnValue(stop);
  const { unmount } = render(
    <ErrorBoundary>
      <Broken />
    </ErrorBoundary>,
  );
  const page = screen.getByRole('alert');
  expect(page.textContent).toContain('TypeError: tag.pose is \ufffdnull');
  expect(screen.getByRole('button', { name: 'Reload' })).toBeTruthy();
  expect(byItself).toHaveBeenCalledOnce();
  unmount();
  expect(stop).toHaveBeenCalledOnce();
});
