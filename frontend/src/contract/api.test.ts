import { beforeEach, describe, expect, test, vi } from 'vitest';

import type { OccupancyGrid } from './types';
import { npyEstimate, npy as npyGrid } from '../testing/field';
import { answer, fetchEstimate, fetchHistory, npyOf, Refusal, route, stateSocketUrl } from './api';

const { signal } = new AbortController();
const fetchMap = (): Promise<object> => answer<OccupancyGrid>(signal, 'api/map', ['info']);

beforeEach(() => {
  document.head.innerHTML = '';
});

describe('addresses', () => {
  test('are relative to the page, behind any path prefix', () => {
    document.head.innerHTML = '<base href="https://farm.example/house-3/#x">';
    expect(route('api/map').href).toBe('https://farm.example/house-3/api/map');
    expect(stateSocketUrl()).toBe('wss://farm.example/house-3/ws/state?delta=1');
  });

  test('an answer of another shape is refused by its address and what it lacks', async () => {
    vi.stubGlobal('fetch', () => Promise.resolve(Response.json({ sensors: [] })));
    await expect(fetchHistory('5', signal)).rejects.toThrow(
      'api/tags/5/history: the answer has no "tries"',
    );
  });

  test('a tag’s id is written so that it stays one part of the path', async () => {
    let requests = '';
    vi.stubGlobal('fetch', (url: URL) => {
      requests = url.href;
      return Promise.resolve(
        Response.json({ tag_id: 'a/b?c', source: null, sensors: [], tries: [] }),
      );
    });
    await fetchHistory('a/b?c', signal);
    expect(requests).toMatch(/\/api\/tags\/a%2Fb%3Fc\/history$/);
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
    const error: unknown = await fetchMap().catch((reason: unknown) => reason);
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
  await expect(fetchMap()).rejects.toThrow(message);
});

describe('npy', () => {
  test('rows, columns and values, NaN as NaN', () => {
    const { shape, values } = npyOf(npyGrid([2, 3], [1, 2, 3, NaN, 5, 6.5]), 2);
    expect(shape).toEqual([2, 3]);
    expect([...values]).toEqual([1, 2, 3, NaN, 5, 6.5]);
  });

  test.each([
    ['dimensions', npyGrid([6], [1, 2, 3, 4, 5, 6]), /2 dimensions/],
    ['format', new TextEncoder().encode('<html>Sign in</html>').buffer, /2 dimensions/],
    ['length', new Uint8Array([0x93, 0x4e]).buffer, /2 dimensions/],
  ])('refuses a wrong %s', (_, buffer, message) => {
    expect(() => npyOf(buffer, 2)).toThrow(message);
  });
});

describe('an estimate', () => {
  test('has means, errors and what counts as known', async () => {
    let requests = '';
    vi.stubGlobal('fetch', (url: URL) => {
      requests = url.pathname + url.search;
      return Promise.resolve(npyEstimate([21, 22, 23], [0.5, 1, 2], 0.75));
    });
    const query = { sensor: 'co2', resolution: 0.1, at: 50 };
    const estimate = await fetchEstimate(query, signal);
    expect(requests).toBe('/api/estimate.npy?sensor_type=co2&resolution=0.1&at=50.000');
    expect([...estimate.mean]).toEqual([21, 22, 23]);
    expect([...estimate.sd]).toEqual([0.5, 1, 2]);
    expect(estimate).toMatchObject({
      ...{ width: 3, height: 1, originX: -1.5, originY: 0.5, resolution: 1 },
      ...{ sdKnown: 0.75, sampleCount: 4 },
    });
  });

  test.each([
    ['one grid alone', new Response(npyGrid([1, 2], [1, 2])), /expected 3 dimensions/],
    [
      'a header that is missing',
      ((response: Response) => {
        response.headers.delete('X-Estimate-Sd-Known');
        return response;
      })(npyEstimate([1], [1])),
      /X-Estimate-Sd-Known/,
    ],
  ])('%s is refused', async (_, response, message) => {
    vi.stubGlobal('fetch', () => Promise.resolve(response));
    await expect(fetchEstimate({ sensor: 'co2', resolution: 1 }, signal)).rejects.toThrow(message);
  });
});
