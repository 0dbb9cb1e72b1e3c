import { expect, test, vi } from 'vitest';

import {
  DEFAULT_SETTINGS,
  isColumnShown,
  keepStored,
  openStorage,
  readSettings,
  SETTINGS_KEY,
  withColumn,
} from './settings';

const storage = (text: string | null): { getItem: () => string | null } => ({
  getItem: () => text,
});

test('what was kept comes back', () => {
  let stored = '';
  const settings = {
    theme: 'dark',
    unit: 'F',
    shortcuts: false,
    hidden: ['pest', 'co2'],
    byArea: true,
    dayBefore: true,
    sound: true,
    notify: true,
  } as const;
  keepStored({ setItem: (_, value) => (stored = value) }, SETTINGS_KEY, settings);
  expect(readSettings(storage(stored))).toEqual(settings);
});

test.each([null, '', '{', 'null', '7', '[]', '{"hidden":5}', '{"hidden":null}'])(
  '%j counts as nothing stored',
  (text) => {
    expect(readSettings(storage(text))).toEqual(DEFAULT_SETTINGS);
  },
);

test('a column is hidden and shown again; that of the tag stays', () => {
  const hidden = withColumn(withColumn([], 'pest', false), 'tag', false);
  expect(hidden).toEqual(['pest']);
  expect(isColumnShown({ hidden }, 'pest')).toBe(false);
  expect(isColumnShown({ hidden: ['tag'] }, 'tag')).toBe(true);
  expect(withColumn(hidden, 'pest', true)).toEqual([]);
});

test('a forbidden storage keeps nothing and does no harm', () => {
  vi.spyOn(window, 'localStorage', 'get').mockImplementation(() => {
    throw new Error('SecurityError');
  });
  const storage = openStorage();
  keepStored(storage, SETTINGS_KEY, DEFAULT_SETTINGS);
  expect(readSettings(storage)).toEqual(DEFAULT_SETTINGS);
});

test('a full storage does no harm', () => {
  const full = {
    setItem: () => {
      throw new Error('quota');
    },
  };
  expect(() => {
    keepStored(full, SETTINGS_KEY, DEFAULT_SETTINGS);
  }).not.toThrow();
});
