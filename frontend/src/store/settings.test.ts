import { expect, test, vi } from 'vitest';

import { DEFAULT_SETTINGS, keepSettings, openStorage, readSettings } from './settings';

const storage = (text: string | null): { getItem: () => string | null } => ({
  getItem: () => text,
});

test('what was kept comes back', () => {
  let kept = '';
  const settings = { theme: 'dark', unit: 'F', shortcuts: false } as const;
  keepSettings({ setItem: (_, value) => (kept = value) }, settings);
  expect(readSettings(storage(kept))).toEqual(settings);
});

test.each([null, '', '{', 'null', '7', '{"theme":"pink","unit":"K"}'])(
  '%j counts as nothing kept',
  (text) => {
    expect(readSettings(storage(text))).toEqual(DEFAULT_SETTINGS);
  },
);

test('a forbidden storage keeps nothing and does no harm', () => {
  vi.spyOn(window, 'localStorage', 'get').mockImplementation(() => {
    throw new Error('SecurityError');
  });
  const storage = openStorage();
  keepSettings(storage, DEFAULT_SETTINGS);
  expect(readSettings(storage)).toEqual(DEFAULT_SETTINGS);
});

test('a full storage does no harm', () => {
  const full = {
    setItem: () => {
      throw new Error('quota');
    },
  };
  expect(() => {
    keepSettings(full, DEFAULT_SETTINGS);
  }).not.toThrow();
});
