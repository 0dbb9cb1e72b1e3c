/** The operator's settings on this device, in the browser's local storage. */
import type { TemperatureUnit } from '../domain/sensors';

export interface Settings {
  readonly theme: 'system' | 'light' | 'dark';
  readonly unit: TemperatureUnit;
  /** Single-key shortcuts, which speech input can trigger by accident (WCAG 2.1.4). */
  readonly shortcuts: boolean;
  /** Ids of hidden table columns; a sensor's id is its name. */
  readonly hidden: readonly string[];
  /** Whether the table's rows are grouped by area, if there are areas. */
  readonly byArea: boolean;
  readonly dayBefore: boolean;
  /** Whether new alarms are heard, and shown while nobody looks at the page. */
  readonly sound: boolean;
  readonly notify: boolean;
}

export const DEFAULT_SETTINGS: Settings = {
  theme: 'system',
  unit: 'C',
  shortcuts: true,
  hidden: [],
  byArea: false,
  dayBefore: false,
  sound: false,
  notify: false,
};

/** The tag's own column is always shown. */
export const isColumnShown = ({ hidden }: Pick<Settings, 'hidden'>, id: string): boolean =>
  id === 'tag' || !hidden.includes(id);

export const withColumn = (
  hidden: readonly string[],
  id: string,
  on: boolean,
): readonly string[] =>
  on || id === 'tag' ? hidden.filter((each) => each !== id) : [...new Set([...hidden, id])];

export const SETTINGS_KEY = 'lupin-twin.settings';

/** Reads the stored settings; missing or damaged ones get their defaults. */
export function readSettings(storage: Pick<Storage, 'getItem'>): Settings {
  try {
    const stored = JSON.parse(storage.getItem(SETTINGS_KEY) ?? '{}') as Partial<Settings>;
    // A stored value that is no list would crash the page on every load.
    const hidden = Array.isArray(stored.hidden) ? stored.hidden : [];
    return { ...DEFAULT_SETTINGS, ...stored, hidden };
  } catch {
    return DEFAULT_SETTINGS;
  }
}

/** The browser's storage; if forbidden, one that stores nothing. */
export function openStorage(): Pick<Storage, 'getItem' | 'setItem'> {
  try {
    return window.localStorage;
  } catch {
    return { getItem: () => null, setItem: () => undefined };
  }
}

export function keepStored(storage: Pick<Storage, 'setItem'>, key: string, value: object): void {
  try {
    storage.setItem(key, JSON.stringify(value));
  } catch {
    // Storage is full or blocked: the value then lasts as long as the page.
  }
}
