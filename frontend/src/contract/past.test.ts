import { describe, expect, test, vi } from 'vitest';

import { judgement, NOBODY, reason } from '../testing/health';
import { stateFrame } from '../testing/tags';
import { wireTimeline } from '../testing/timeline';
import { momentParameter } from './api';
import { fetchStateAt, fetchTimeline } from './past';

const { signal } = new AbortController();

const answering = (body: unknown, health: unknown = NOBODY): string[] => {
  const requests: string[] = [];
  vi.stubGlobal('fetch', (url: URL) => {
    requests.push(`${url.pathname}${url.search}`);
    return Promise.resolve(Response.json(url.pathname === '/api/health' ? health : body));
  });
  return requests;
};

describe('the state of a moment', () => {
  const { state } = stateFrame([], { sec: 1_794_000_000 });
  const half = { ...state, header: { ...state.header, stamp: 12.5 } };

  test('is requested to the millisecond, with the verdicts of that moment', async () => {
    const health = judgement({ 1: [reason()] });
    const stamp = { sec: 12, nanosec: 500_000_000 };
    const requests = answering({ ...half, header: { ...half.header, stamp } }, health);
    await expect(fetchStateAt(12.5, signal)).resolves.toMatchObject({ state: half, health });
    expect(requests).toEqual(['/api/state?at=12.500', '/api/health?at=12.500']);
    expect([momentParameter(1_794_000_000.125), momentParameter(1e-7)]).toEqual([
      '1794000000.125',
      '0.000',
    ]);
  });

  test.each([
    [{}, true],
    [{ 'X-Complete-To': '12.500000000', 'X-Kept-From': '12.500000000' }, true],
    [{ 'X-Complete-To': '12.4', 'X-Kept-From': '1' }, false],
    [{ 'X-Complete-To': '12.5', 'X-Kept-From': '12.6' }, false],
  ])('is whole if the journal has all that leads up to it: %o', async (headers, isWhole) => {
    vi.stubGlobal('fetch', (url: URL) =>
      Promise.resolve(Response.json(url.pathname === '/api/health' ? NOBODY : half, { headers })),
    );
    await expect(fetchStateAt(12.5, signal)).resolves.toMatchObject({ isWhole });
  });
});

test('the timeline is requested for a period, or for the whole history', async () => {
  const wire = wireTimeline({ from: 5, to: 9.5 });
  const requests = answering(wire);
  await expect(fetchTimeline({ from: 5, to: 9.5 }, 240, signal)).resolves.toEqual(wire);
  await fetchTimeline(null, 240, signal);
  expect(requests).toEqual([
    '/api/timeline?points=240&from=5.000&to=9.500',
    '/api/timeline?points=240',
  ]);
});
