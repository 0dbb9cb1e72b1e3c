import { afterEach, beforeEach, expect, test, vi, type Mock } from 'vitest';

import { prefer } from './app';
import { DEFAULT_SETTINGS } from './settings';
import { isDark, isPrinting, onThemeChange, startTheme } from './theme';
import { started } from '../testing/life';

let listener: Mock<() => void>;
let stops: (() => void)[];

beforeEach(() => {
  prefer(DEFAULT_SETTINGS);
  listener = vi.fn<() => void>();
  stops = [started((on) => onThemeChange(listener, on)), started(startTheme)];
});
afterEach(() => {
  for (const stop of stops) stop();
});

const fire = (type: string): void => {
  window.dispatchEvent(new Event(type));
};
const root = document.documentElement.dataset;

test('the operator’s choice is followed, and told once', () => {
  prefer({ theme: 'dark' });
  expect(isDark()).toBe(true);
  expect(root['theme']).toBe('dark');
  expect(listener).toHaveBeenCalledTimes(1);
  prefer({ unit: 'F' });
  expect(listener).toHaveBeenCalledTimes(1);
});

test('paper is light, and the screen is dark again after it', () => {
  prefer({ theme: 'dark' });
  fire('beforeprint');
  expect([isDark(), isPrinting(), root['theme']]).toEqual([false, true, 'light']);
  // Nor does paper have the screen's forced colours.
  expect(root['printing']).toBe('');
  fire('afterprint');
  expect(root['printing']).toBeUndefined();
  expect([isDark(), isPrinting(), root['theme']]).toEqual([true, false, 'dark']);
});

test('who has stopped listening is not told', () => {
  for (const stop of stops.splice(0)) stop();
  prefer({ theme: 'dark' });
  fire('beforeprint');
  fire('afterprint');
  expect(listener).not.toHaveBeenCalled();
  expect(root['theme']).toBe('light');
});
