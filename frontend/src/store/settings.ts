/** What the operator prefers on this device; kept in the browser's local storage. */
import type { TemperatureUnit } from '../domain/units';

export interface Settings {
  readonly theme: 'system' | 'light' | 'dark';
  readonly unit: TemperatureUnit;
  /** Single-key shortcuts, which some speech input sets off by chance (WCAG 2.1.4). */
  readonly shortcuts: boolean;
}

export const DEFAULT_SETTINGS: Settings = { theme: 'system', unit: 'C', shortcuts: true };

const KEY = 'lupin-twin.settings';

/** Reads what was kept; anything unknown or damaged counts as the default. */
export function readSettings(storage: Pick<Storage, 'getItem'>): Settings {
  let kept: Partial<Record<keyof Settings, unknown>>;
  try {
    const parsed: unknown = JSON.parse(storage.getItem(KEY) ?? '{}');
    kept = typeof parsed === 'object' && parsed !== null ? parsed : {};
  } catch {
    return DEFAULT_SETTINGS;
  }
  return {
    theme: kept.theme === 'light' || kept.theme === 'dark' ? kept.theme : 'system',
    unit: kept.unit === 'F' ? 'F' : 'C',
    shortcuts: kept.shortcuts !== false,
  };
}

/** The browser's storage; where it is forbidden, one that keeps nothing. */
export function openStorage(): Pick<Storage, 'getItem' | 'setItem'> {
  try {
    return window.localStorage;
  } catch {
    return { getItem: () => null, setItem: () => undefined };
  }
}

export function keepSettings(storage: Pick<Storage, 'setItem'>, settings: Settings): void {
  try {
    storage.setItem(KEY, JSON.stringify(settings));
  } catch {
    // Storage is full or forbidden: the settings then last as long as the page.
  }
}
