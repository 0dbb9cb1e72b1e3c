import { expect, test, vi } from 'vitest';

import { asFound } from './asFound';

test('what a file adds, starts and puts in the place of global things is gone with it', async () => {
  const before = Object.entries(window);
  const putBack = asFound();
  const listener = vi.fn();
  const rung = vi.fn();
  vi.stubGlobal('matchMedia', vi.fn());
  vi.spyOn(document, 'hidden', 'get').mockReturnValue(true);
  window.addEventListener('online', listener);
  document.addEventListener('keydown', listener);
  setInterval(rung, 1);
  setTimeout(rung, 1);
  document.body.append('text');
  document.head.append(document.createElement('style'));
  document.documentElement.dataset['theme'] = 'dark';
  localStorage.setItem('key', 'value');
  history.replaceState(null, '', '/#tag=1');
  vi.spyOn(window, 'localStorage', 'get').mockImplementation(() => {
    throw new Error('SecurityError');
  });
  const { HOME } = process.env;
  vi.stubEnv('HOME', '/elsewhere');
  await putBack();
  window.dispatchEvent(new Event('online'));
  document.dispatchEvent(new Event('keydown'));
  expect(Object.entries(window)).toEqual(before);
  expect(document.hidden).toBe(false);
  expect(document.documentElement.outerHTML).toBe('<html><head></head><body></body></html>');
  expect(localStorage).toHaveLength(0);
  expect(location.hash).toBe('');
  expect(process.env['HOME']).toBe(HOME);
  // One that rings later than those would have.
  await new Promise((rings) => setTimeout(rings, 5));
  expect(rung).not.toHaveBeenCalled();
  expect(listener).not.toHaveBeenCalled();
});

test('modules of one file are not those of the next', async () => {
  const one = await import('../store/app');
  await asFound()();
  expect((await import('../store/app')).store).not.toBe(one.store);
});
