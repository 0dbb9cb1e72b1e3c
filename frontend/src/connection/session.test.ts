import { afterEach, expect, test, vi } from 'vitest';

import { signInIfAsked } from './session';

afterEach(() => {
  vi.unstubAllGlobals();
});

const answering = (status: number): void => {
  vi.stubGlobal('fetch', () => Promise.resolve(new Response(null, { status })));
};

test('a server that wants a token is one to sign in at', async () => {
  const leave = vi.fn<(url: URL) => void>();
  answering(401);
  await signInIfAsked(leave);
  expect(leave.mock.calls.map(([url]) => url.pathname)).toEqual(['/signin']);
});

test.each([200, 403, 503])('a server that answers %i keeps the page', async (status) => {
  const leave = vi.fn<(url: URL) => void>();
  answering(status);
  await signInIfAsked(leave);
  expect(leave).not.toHaveBeenCalled();
});

test('a server that is away keeps the page', async () => {
  const leave = vi.fn<(url: URL) => void>();
  vi.stubGlobal('fetch', () => Promise.reject(new TypeError('Failed to fetch')));
  await signInIfAsked(leave);
  expect(leave).not.toHaveBeenCalled();
});
