import { describe, expect, test, vi } from 'vitest';

import { bodies, expectedReading, grade, npyEstimate } from '../testing/estimate';
import { npy } from '../testing/npy';
import { fetchAdvice, fetchEstimate, fetchExpected, fetchGrade } from './estimate';

const { signal } = new AbortController();
let asked = '';
const answer = (response: Response): void => {
  vi.stubGlobal('fetch', (url: URL) => {
    asked = url.pathname + url.search;
    return Promise.resolve(response);
  });
};

describe('an estimate', () => {
  test('has means, errors and what counts as known', async () => {
    answer(npyEstimate([21, 22, 23], [0.5, 1, 2], 0.75));
    const query = { sensor: 'co2', resolution: 0.1, at: 50 };
    const estimate = await fetchEstimate(query, signal);
    expect(asked).toBe('/api/estimate.npy?sensor_type=co2&resolution=0.1&at=50.000');
    expect([...estimate.mean]).toEqual([21, 22, 23]);
    expect([...estimate.sd]).toEqual([0.5, 1, 2]);
    expect(estimate).toMatchObject({
      ...{ width: 3, height: 1, originX: -1.5, originY: 0.5, resolution: 1 },
      ...{ sdKnown: 0.75, sampleCount: 4, readingCount: 40 },
    });
  });

  test.each([
    ['one grid alone', new Response(npy(1, 2, [1, 2])), /expected 3 dimensions/],
    [
      'a header that is missing',
      ((response: Response) => {
        response.headers.delete('X-Estimate-Sd-Known');
        return response;
      })(npyEstimate([1], [1])),
      /X-Estimate-Sd-Known/,
    ],
  ])('%s is refused', async (_, response, message) => {
    answer(response);
    await expect(fetchEstimate({ sensor: 'co2', resolution: 1 }, signal)).rejects.toThrow(message);
  });
});

describe('what is said of an estimate', () => {
  test('how well it has foretold; of a sensor that it has none of, nothing', async () => {
    answer(Response.json(bodies.quality({ co2: grade() })));
    expect((await fetchGrade('co2', signal))?.day).toEqual({ scans: 458, inside: 412 });
    expect(asked).toBe('/api/estimate/quality?sensor_type=co2');
    answer(Response.json(bodies.quality({ co2: grade() })));
    expect(await fetchGrade('toString', signal)).toBeNull();
  });

  test('what was expected, and where another tag would help', async () => {
    const one = expectedReading();
    answer(Response.json(bodies.tags({ '5': one })));
    expect(await fetchExpected('co2', signal)).toEqual({ '5': one });
    const places = [{ x: 1, y: 2, error_ratio: 0.8 }];
    answer(Response.json(bodies.advice(places)));
    expect(await fetchAdvice('co2', 5, signal)).toEqual(places);
    expect(asked).toBe('/api/estimate/advice?sensor_type=co2&places=5');
  });
});
