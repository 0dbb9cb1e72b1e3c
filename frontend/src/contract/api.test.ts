import { beforeEach, describe, expect, test, vi } from 'vitest';

import { fetchHistory, fetchMap, fetchQuality, Refusal, route, stateSocketUrl } from './api';

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

describe('an answer that is none of the contract is an error that names the field', () => {
  test.each([
    [fetchMap, { info: null }, 'map.info: an object, not null'],
    [fetchMap, { info: { resolution: '0.05' } }, 'map.info.resolution: a number, not "0.05"'],
    [
      (s: AbortSignal) => fetchHistory('1', s),
      {
        tag_id: '1',
        source: null,
        tries: [],
        sensors: [{ name: 'co2', values: [{ stamp: 7, value: 1 }] }],
      },
      'history.sensors[0].values[0].stamp: an object, not 7',
    ],
    [(s: AbortSignal) => fetchQuality('co2', s), [], 'quality: an object, not a list of 0'],
  ])('%#', async (fetchIt, body, message) => {
    vi.stubGlobal('fetch', () => Promise.resolve(Response.json(body)));
    await expect(fetchIt(signal)).rejects.toThrow(message);
  });
});
