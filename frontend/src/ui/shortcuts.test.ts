import { fireEvent } from '@testing-library/react';
import { afterEach, beforeAll, beforeEach, describe, expect, test, vi } from 'vitest';

import { theMap, type MapActions } from '../map/commands';
import { act, prefer, store } from '../store/app';
import { started } from '../testing/life';
import { showTags } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import { playback } from '../timebar/playback';
import { startKeys } from './keys';
import { loadParts } from './loadDeferred';

beforeAll(() => loadParts());

const READINGS = readings({ temperature: 20, humidity: 60, co2: 700 });

let stop: () => void;
const fit = vi.fn();

beforeEach(() => {
  showTags(['1', '2', '3'].map((tag_id) => wireTag({ tag_id, readings: READINGS })));
  theMap.set({ fit } as unknown as MapActions);
  stop = started(startKeys);
});
afterEach(() => {
  stop();
  theMap.set(null);
  document.body.replaceChildren();
});

const press = (
  key: string,
  init: KeyboardEventInit = {},
  target: Element = document.body,
): void => {
  fireEvent.keyDown(target, { key, ...init });
};

describe('keys', () => {
  test('digits choose sensors; beyond the last nothing happens', () => {
    press('3');
    expect(store.get().view.sensor).toBe('co2');
    press('9');
    expect(store.get().view.sensor).toBe('co2');
  });

  test('n and p walk through the tags and around', () => {
    const walk = ['n', 'n', 'p', 'p', 'p'].map((key) => {
      press(key);
      return store.get().view.selected;
    });
    expect(walk).toEqual(['1', '2', '1', '3', '2']);
    press('Escape');
    expect(store.get().view.selected).toBeNull();
  });

  test('f fits the map', () => {
    press('f');
    expect(fit).toHaveBeenCalledTimes(1);
  });

  test('not while typing, not with Control, and not when switched off', () => {
    const input = document.body.appendChild(document.createElement('input'));
    press('n', {}, input);
    press('n', { ctrlKey: true });
    prefer({ shortcuts: false });
    press('n');
    expect(store.get().view.selected).toBeNull();
  });

  test('l leads back to now, and is nothing while now is shown', () => {
    act({ moment: 50 });
    press('l');
    expect(store.get().view.moment).toBeNull();
    press('l');
    expect(store.get().view.moment).toBeNull();
  });

  test('Escape closes the card first, and then leads back to now', () => {
    act({ moment: 0.5, selected: '2' });
    press('Escape');
    expect(store.get().view).toMatchObject({ moment: 0.5, selected: null });
    press('Escape');
    expect(store.get().view.moment).toBeNull();
  });

  test('the space bar plays the past, but presses a button that has the focus', () => {
    const button = document.body.appendChild(document.createElement('button'));
    press(' ', {}, button);
    expect(playback.get().isPlaying).toBe(false);
    press(' ');
    expect(playback.get().isPlaying).toBe(true);
    press(' ');
    expect(playback.get().isPlaying).toBe(false);
  });
});
