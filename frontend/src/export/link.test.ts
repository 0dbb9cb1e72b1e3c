import { expect, test, vi } from 'vitest';

import { copyLink } from './link';

test('without a clipboard copying says no instead of failing', async () => {
  expect(await copyLink()).toBe(false);
  const writeText = vi.fn(() => Promise.resolve());
  vi.stubGlobal('navigator', { clipboard: { writeText } });
  expect(await copyLink()).toBe(true);
  expect(writeText).toHaveBeenCalledWith(window.location.href);
});
