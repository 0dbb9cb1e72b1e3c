import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import { started } from '../testing/life';
import { npyField } from '../testing/field';
import { goLive, goLost, showTags, status } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import { act, receive, store } from './app';
import { selectMapped } from './derived';
import { ready } from './fetcher';
import { startLoaders } from './loaders';
import { withLatest } from './twin';

let requests: string[];
let stop: () => void;

beforeEach(() => {
  vi.useFakeTimers();
  requests = [];
  vi.stubGlobal('fetch', (url: URL) => {
    requests.push(`${url.pathname}${url.search}`);
    if (url.pathname === '/api/field.npy') return Promise.resolve(npyField([1, 2]));
    return Promise.resolve(Response.json({ detail: 'none here' }, { status: 404 }));
  });
  showTags([]);
  goLost();
  stop = started(startLoaders);
});
afterEach(() => {
  stop();
  vi.useRealTimers();
});

const settle = (): Promise<unknown> => vi.advanceTimersByTimeAsync(5);
const count = (part: string): number => requests.filter((url) => url.includes(part)).length;
const tags = [wireTag({ readings: readings({ temperature: 20 }) })];

describe('loaders', () => {
  test('fetch the field of the chosen sensor, with its place and range', async () => {
    showTags(tags);
    await settle();
    expect(requests).toContain('/api/field.npy?sensor_type=temperature&resolution=0.05');
    expect(store.get().twin.latest.field.value).toMatchObject({
      sensor: 'temperature',
      originX: -1.5,
      originY: 0.5,
      valueMax: 2,
      sampleCount: 4,
    });
  });

  test('another sensor lets go of the old field at once and fetches its own', async () => {
    showTags(tags);
    await settle();
    expect(selectMapped(store.get())?.sensor).toBe('temperature');
    act({ sensor: 'co2' });
    expect(selectMapped(store.get())).toBeNull();
    await settle();
    expect(selectMapped(store.get())?.sensor).toBe('co2');
  });

  test('the same revision is not fetched again; a new one is, and a new connection', async () => {
    showTags(tags);
    await settle();
    const first = count('field.npy');
    act({ hovered: '1' });
    await vi.advanceTimersByTimeAsync(5_000);
    expect(count('field.npy')).toBe(first);
    showTags(tags);
    await vi.advanceTimersByTimeAsync(1_000);
    expect(count('field.npy')).toBe(first + 1);
  });

  test('nobody pinned, nothing to ask for', async () => {
    const pose = { position: { x: 0, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 0 } };
    showTags([wireTag({ pose })]);
    await settle();
    expect(count('field.npy')).toBe(0);
  });

  test('a map is asked for only where the bridge has one', async () => {
    showTags(tags);
    await settle();
    expect(count('/api/map')).toBeGreaterThan(0);
    requests.length = 0;
    goLive(status({ has_map: false }));
    showTags(tags);
    goLive(status({ has_map: false }));
    await vi.advanceTimersByTimeAsync(40_000);
    expect(count('/api/map')).toBeLessThanOrEqual(2);
  });

  test('of a restarted bridge that has no twin yet, the map that is shown stays', () => {
    showTags(tags);
    const placement = { originX: 0, originY: 0, yaw: 0, resolution: 1, width: 1, height: 1 };
    const value = { placement, pixels: new ImageData(1, 1), known: [] };
    receive(withLatest({ map: ready(value) }));
    goLive(status({ twin: 'offline', reason: 'never_seen', has_map: false }));
    expect(store.get().twin.latest.map.value).toBe(value);
    goLive(status({ has_map: false }));
    expect(store.get().twin.latest.map.value).toBeNull();
  });

  test('a refusal is kept with its reason', async () => {
    vi.stubGlobal('fetch', () =>
      Promise.resolve(
        Response.json({ ok: false, error_message: 'resolution is 0' }, { status: 400 }),
      ),
    );
    showTags(tags);
    await settle();
    expect(store.get().twin.latest.field).toMatchObject({
      state: 'failed',
      message: 'resolution is 0',
    });
  });

  test('without a connection nothing is fetched, nor what had failed tried again', async () => {
    showTags(tags);
    await settle();
    expect(store.get().twin.latest.map.state).toBe('failed');
    goLost();
    requests.length = 0;
    await vi.advanceTimersByTimeAsync(60_000);
    expect(requests).toEqual([]);
  });
});
