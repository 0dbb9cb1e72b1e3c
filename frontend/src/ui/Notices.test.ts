import { beforeEach, describe, expect, test } from 'vitest';

import { act, receive, store } from '../store/app';
import { NO_HOUSE, NO_TWIN } from '../store/twin';
import { goLive, goLost, showTags, status } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import { noticeFor } from './Notices';

const id = (): string | undefined => noticeFor(store.get())?.id;
const noPose = { position: { x: 0, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 0 } };

describe('before the first state', () => {
  const empty = { ...store.get(), twin: NO_TWIN };

  test('connecting, then unreachable, or no twin', () => {
    expect(noticeFor(empty)?.id).toBe('connecting');
    goLost();
    const lost = store.get().twin;
    expect(noticeFor({ ...empty, twin: { ...lost, latest: NO_HOUSE } })?.id).toBe('unreachable');
    goLive(status({ twin: 'offline', reason: 'never_seen' }));
    const offline = { ...store.get().twin, latest: NO_HOUSE };
    expect(noticeFor({ ...empty, twin: offline })).toMatchObject({ id: 'no-twin' });
  });
});

describe('the most basic lack is told first', () => {
  beforeEach(() => {
    showTags([wireTag({ readings: readings({ temperature: 20 }) })]);
  });

  test('no tags', () => {
    showTags([]);
    expect(id()).toBe('no-tags');
  });

  test('no pins', () => {
    showTags([wireTag({ pose: noPose, readings: readings({ temperature: 20 }) })]);
    expect(id()).toBe('no-pins');
  });

  test('no reading of the chosen sensor, which is named', () => {
    act({ type: 'sensor', sensor: 'co2' });
    expect(noticeFor(store.get())).toMatchObject({ id: 'no-reading' });
    expect(noticeFor(store.get())?.title).toContain('CO₂');
  });

  test('no map', () => {
    goLive(status({ has_map: false }));
    expect(id()).toBe('no-map');
  });

  test('a field that could not be fetched, with the server’s reason', () => {
    receive({ type: 'field', field: { value: null, state: 'failed', message: 'too many cells' } });
    expect(noticeFor(store.get())?.title).toContain('too many cells');
  });

  test('nothing is lacking', () => {
    expect(id()).toBeUndefined();
  });
});
