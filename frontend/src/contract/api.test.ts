import { beforeEach, describe, expect, test, vi } from 'vitest';

import { fetchHistory, fetchMap, Refusal, route, stateSocketUrl } from './api';

const { signal } = new AbortController();

beforeEach(() => {
  document.head.innerHTML = '';
});

describe('addresses', () => {
  test('are relative to the page, behind any path prefix', () => {
    document.head.innerHTML = '<base href="https://farm.example/house-3/#x">';
    expect(route('api/map').href).toBe('https://farm.example/house-3/api/map');
    expect(stateSocketUrl()).toBe('wss://farm.example/house-3/ws/state?delta=1');
  });

  test('a tag’s id is written so that it stays one part of the path', async () => {
    let asked = '';
    vi.stubGlobal('fetch', (url: URL) => {
      asked = url.href;
      return Promise.resolve(
        Response.json({ tag_id: 'a/b?c', source: null, sensors: [], tries: [] }),
      );
    });
    await fetchHistory('a/b?c', signal);
    expect(asked).toMatch(/\/api\/tags\/a%2Fb%3Fc\/history$/);
  });
});

describe('refusals', () => {
  test.each([
    [{ detail: 'no map yet' }, 'no map yet'],
    [{ error_message: 'too many cells', ok: false }, 'too many cells'],
    [{}, '404'],
    ['text', '404'],
  ])('%j becomes %j', async (body, message) => {
    vi.stubGlobal('fetch', () => Promise.resolve(Response.json(body, { status: 404 })));
    const error: unknown = await fetchMap(signal).catch((reason: unknown) => reason);
    expect(error).toBeInstanceOf(Refusal);
    expect(error).toMatchObject({ status: 404, message });
  });
});

test.each([
  [Response.json(null), '/api/map: answered with null'],
  [Response.json(7), '/api/map: answered with 7'],
  [
    new Response('<html>Sign in</html>', { headers: { 'Content-Type': 'text/html' } }),
    '/api/map: answered with text/html',
  ],
])('an answer that is no object of JSON is an error that names it, %#', async (answer, message) => {
  Object.defineProperty(answer, 'url', { value: 'http://localhost/api/map' });
  vi.stubGlobal('fetch', () => Promise.resolve(answer));
  await expect(fetchMap(signal)).rejects.toThrow(message);
});
