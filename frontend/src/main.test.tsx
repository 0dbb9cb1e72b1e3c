import { act as flush, fireEvent } from '@testing-library/react';
import { afterEach, beforeEach, expect, test, vi } from 'vitest';

beforeEach(() => {
  vi.resetModules();
  vi.stubGlobal('fetch', () => Promise.reject(new Error('no server')));
  vi.stubGlobal(
    'WebSocket',
    class extends EventTarget {
      close(): void {
        // It never was open.
      }
    },
  );
  localStorage.clear();
  document.body.innerHTML = '<div id="root"></div>';
});
afterEach(() => {
  history.replaceState(null, '', '/');
});

test.each([
  // In this order: what a page has begun to listen to lasts as long as the document.
  ['?kiosk', 'light', 0],
  ['', 'dark', 1],
])('with “%s” the key T leaves it %s', async (query, theme, buttons) => {
  history.replaceState(null, '', `/${query}`);
  await flush(() => import('./main'));
  const { loadParts } = await import('./ui/loadDeferred');
  await flush(() => loadParts());
  const { store } = await import('./store/app');
  fireEvent.keyDown(document.body, { key: 't' });
  expect(document.documentElement.dataset['theme']).toBe(theme);
  expect(store.get().settings.theme).toBe(theme === 'dark' ? 'dark' : 'system');
  expect(document.querySelectorAll('.menu')).toHaveLength(buttons);
});
