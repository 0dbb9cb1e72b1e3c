import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';

import { beforeEach, describe, expect, test } from 'vitest';

import { ageSeconds } from '../domain/time';
import { snapshotOf } from '../domain/twin';
import { goLive, showTags, status } from '../testing/page';
import { judgement, reason } from '../testing/health';
import { readings, stateFrame, wireTag } from '../testing/tags';
import { act, receive, store } from './app';
import { selectHealth, selectRange, selectRows, selectSensors } from './derived';
import {
  rosNow,
  selectAwaited,
  selectShown,
  selectTag,
  selectTags,
  shownAt,
  shownTime,
} from './moment';
import { NO_HOUSE, NO_TWIN, type House, withLatest, withPast } from './twin';

const then = (): House => ({
  ...NO_HOUSE,
  snapshot: snapshotOf(
    stateFrame([wireTag({ tag_id: 'old', readings: readings({ temperature: 40, ph: 6 }, 75) })]),
    1_000,
    null,
  ),
  health: judgement({ old: [reason()] }),
});

beforeEach(() => {
  showTags(
    [wireTag({ tag_id: 'new', readings: readings({ temperature: 20 }) })],
    judgement({ new: [reason()] }),
  );
  receive(withPast({ at: 77, house: then() }));
});

describe('another moment', () => {
  test('changes all that is selected, and the way back too', () => {
    const look = (): unknown => {
      const state = store.get();
      return {
        tags: selectTags(state).map(({ id }) => id),
        rows: selectRows(state).map(({ tag }) => tag.id),
        health: [...selectHealth(state).byTag.keys()],
        sensors: selectSensors(state).some(({ name }) => name === 'ph'),
        range: selectRange(state),
        isThere: selectTag(state, 'old') !== undefined,
      };
    };
    const now = look();
    expect(now).toMatchObject({ tags: ['new'], rows: ['new'], health: ['new'], isThere: false });
    act({ moment: 77 });
    expect(look()).toEqual({
      tags: ['old'],
      rows: ['old'],
      health: ['old'],
      sensors: true,
      range: { low: 18, high: 40 },
      isThere: true,
    });
    act({ moment: null });
    expect(look()).toEqual(now);
  });

  test('has ages of its own, which do not go on', () => {
    act({ moment: 77 });
    const [tag] = selectShown(store.get()).snapshot?.tags ?? [];
    for (const now of [1_000, 999_000])
      expect(ageSeconds(tag?.scannedAt ?? null, shownTime(store.get(), now))).toBe(30);
  });

  test('that is not here yet leaves the last one that came, with its own time', () => {
    const { twin } = store.get();
    expect(shownAt(twin, 78)).toBe(shownAt(twin, 77));
    expect(shownAt(twin, 78).moment).toBe(77);
    act({ moment: 78 });
    expect(selectAwaited(store.get())).toBe(78);
    act({ moment: 77 });
    expect(selectAwaited(store.get())).toBeNull();
  });

  test('of which nothing has come leaves now, which is called now', () => {
    receive(withPast(null));
    const { twin } = store.get();
    expect(shownAt(twin, 78)).toBe(shownAt(twin, null));
    expect(shownAt(twin, 78).moment).toBeNull();
    expect(shownAt(NO_TWIN, null)).toMatchObject(NO_HOUSE);
  });

  test('has the map of now, for of maps nobody keeps a past', () => {
    const picture = { value: null, state: 'failed', message: 'x' } as const;
    receive(withLatest({ map: picture }));
    expect(shownAt(store.get().twin, 77).map).toBe(picture);
  });

  test('is the same object for the same data', () => {
    const { twin } = store.get();
    const now = shownAt(twin, null);
    expect(shownAt(twin, 77)).toBe(shownAt(twin, 77));
    expect(shownAt(twin, null)).toBe(now);
    expect(selectShown(store.get())).toBe(now);
  });
});

describe('how ages go on', () => {
  const goOn = (): number | null => {
    const [first, later] = [0, 60_000].map((ms) => shownTime(store.get(), performance.now() + ms));
    return first == null || later == null ? null : Math.round(later - first);
  };

  test.each([
    ['live', 'live', 60],
    // In a pause they stand still, whatever the browser’s clock says.
    ['live', 'paused', 0],
    ['offline', 'stale', 60],
    ['offline', 'no_clock', null],
    ['offline', 'clock_stopped', null],
    ['offline', 'clock_doubted', null],
  ] as const)('twin %s, %s: by %s seconds in a minute', (twin, reason, seconds) => {
    goLive(status({ twin, reason }));
    expect(goOn()).toBe(seconds);
    expect(selectShown(store.get())).toBe(selectShown(store.get()));
  });

  test('whether a pause goes on nobody knows whose connection is lost', () => {
    goLive(status({ reason: 'paused' }), 60_000);
    expect(goOn()).toBeNull();
  });
});

describe('the twin’s time', () => {
  test('goes on with the page’s clock', () => {
    goLive();
    const state = store.get();
    const { at, takenAt } = state.twin.latest.snapshot ?? { at: 0, takenAt: 0 };
    expect(rosNow(state, takenAt + 2_500)).toBeCloseTo(at + 2.5, 9);
    expect(rosNow(state, takenAt - 2_500)).toBe(at);
  });

  test.each(['paused', 'no_clock', 'clock_stopped'] as const)('stands still: %s', (reason) => {
    goLive(status({ twin: reason === 'paused' ? 'live' : 'offline', reason }));
    const state = store.get();
    const { at, takenAt } = state.twin.latest.snapshot ?? { at: 0, takenAt: 0 };
    expect(rosNow(state, takenAt + 60_000)).toBe(at);
  });

  test('is not known before anything came', () => {
    expect(rosNow({ ...store.get(), twin: NO_TWIN }, 0)).toBeNull();
  });
});

test('nobody else reads the houses of the store', () => {
  const src = join(import.meta.dirname, '..');
  const readers = readdirSync(src, { recursive: true, encoding: 'utf8' }).filter(
    (name) =>
      /\.tsx?$/.test(name) &&
      !/\.test\.tsx?$/.test(name) &&
      /\btwin\??\.(latest|past)\b/.test(readFileSync(join(src, name), 'utf8')),
  );
  expect(readers.map((name) => name.replaceAll('\\', '/'))).toEqual(['store/moment.ts']);
});

test('nobody asks a clock of the browser but the page’s own clock', () => {
  const src = join(import.meta.dirname, '..');
  const readers = readdirSync(src, { recursive: true, encoding: 'utf8' }).filter(
    (name) =>
      /\.tsx?$/.test(name) &&
      !/\.test\.tsx?$|^testing/.test(name) &&
      /\b(performance|Date)\.now\b/.test(readFileSync(join(src, name), 'utf8')),
  );
  expect(readers).toEqual(['clock.ts']);
});
