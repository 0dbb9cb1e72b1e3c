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
  ['?kiosk', 'tags', 0],
  ['', 'alarms', 1],
])('with “%s” the key A leaves the list of %s', async (query, list, buttons) => {
  history.replaceState(null, '', `/${query}`);
  await flush(() => import('./main'));
  const { loadParts } = await import('./ui/loadDeferred');
  await flush(() => loadParts());
  const { store } = await import('./store/app');
  fireEvent.keyDown(document.body, { key: 'a' });
  expect(store.get().view.list).toBe(list);
  expect(document.querySelectorAll('.menu')).toHaveLength(buttons);
});
